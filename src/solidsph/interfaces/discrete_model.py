"""DiscreteModel: the discretised problem that boundary handlers and effects are bound to."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import attrs
from scipy.sparse import block_diag, csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array, Indices
from solidsph.model.particles import Face, Particles
from solidsph.model.regions import Where, described, select, some_of
from solidsph.model.surface import Conditions, Pieces


@attrs.frozen(eq=False)
class DiscreteModel:
    """Bodies, the particles of all of them, and their masses."""

    particles: Particles
    masses: Array  # (n,) [kg], 0 for ghosts
    bodies: Sequence[Body]
    end: float = inf  # end of the duration [s]; formulas in t may have no value beyond it
    conditions: Conditions = attrs.field(factory=dict)  # that define the scene's own tags

    @property
    def filters(self) -> bool:
        """Whether a body filters its dilatation."""
        return any(body.dilatation_filter is not None for body in self.bodies)

    def select(self, where: Where) -> Indices:
        """Indices of the particles at `where`, (k,).

        Raises:
            SceneError: no particle is there, or `where` cannot be understood.
        """
        return select(self.particles, where)

    def surface(self, where: Where) -> Face:
        """The surface at `where`: the faces that it names, or all surface of its particles.

        Raises:
            SceneError: no surface is there, or `where` cannot be understood.
        """
        pieces = self.pieces()
        chosen = pieces.at(where) & (pieces.areas != 0.0)
        if not chosen.any():
            self.select(where)  # raises if there is no particle either
            raise SceneError(
                f"no particle at {described(where)} lies on the surface; name a face: "
                f"{some_of(pieces.names) or 'there is none'} ('or' joins two of them; no surface "
                "is on both)"
            )
        return pieces.owned(chosen)

    def pieces(self) -> Pieces:
        """The whole surface, in pieces."""
        return Pieces.of(self.particles, self.conditions)

    def smoothing_matrix(self) -> csr_array:
        """Sparse matrix W of the paper's eq. 8, (n, n): its product with values smooths them."""
        return csr_array(block_diag([_smoothing(body) for body in self.bodies], format="csr"))


def _smoothing(body: Body) -> csr_array:
    pairs = body.pairs()
    weights = body.smoothing.values_of(pairs)
    return pairs.matrix(weights * body.particles.cells[pairs.columns])
