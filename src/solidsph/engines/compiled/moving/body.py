"""MovingBody: a body whose neighbours and weights are recomputed at every evaluation, prepared."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.moving.kernel_pass import KernelPass, kernel_pass
from solidsph.engines.compiled.moving.neighbourhoods import Neighbourhoods, Place, fill, kernel_sums
from solidsph.engines.compiled.moving.pointwise_sums import PointwiseSums
from solidsph.engines.compiled.moving.search import NeighbourSearch
from solidsph.engines.compiled.moving.weighted_sums import WeightedSums
from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.engines.compiled.vectors import MATRIX
from solidsph.interfaces.body import Body
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.maths.arrays import Array


@final
@attrs.define(eq=False)
class MovingBody:
    """The compiled loops over the pairs of a body, and the arrays that they fill.

    What is kept between evaluations does not influence their results. The sums are always in double
    precision, because they are of positions, not of displacements alone.
    """

    body: Body
    law: Any  # compiled (tensors (n, d, d), params): T in place of H
    search: NeighbourSearch
    kernel: KernelPass
    sums: PointwiseSums | WeightedSums
    pair_count: int = attrs.field(init=False)
    reference_sums: Array = attrs.field(init=False)  # (n,) of the kernel, in the reference [-]
    tensors: Array = attrs.field(init=False)  # (n, d, d) H, or the stress that acts
    _own_value: float = attrs.field(init=False)  # W(0) [m^-d]
    _rows: Neighbourhoods = attrs.field(init=False)
    _values: Array = attrs.field(init=False)  # (k,) W of near pairs
    _slopes: Array = attrs.field(init=False)  # (k,) W'(r) / r of near pairs
    _place: Place | None = attrs.field(init=False, default=None)

    precision: ClassVar[float] = sys.float_info.epsilon

    def __attrs_post_init__(self) -> None:
        particles = self.body.particles
        self.tensors = np.empty((particles.count, particles.dimension, particles.dimension))
        self._values = self._slopes = np.empty(0)
        self._own_value = float(self.body.smoothing.value(np.zeros(1))[0])
        self.reference_sums = self._searched(particles.positions)
        self.pair_count = self._rows.pair_count

    @property
    def fused(self) -> bool:
        """True: both passes are one call where no term changes the stress between them."""
        return True

    @property
    def bytes(self) -> int:
        """Memory of the arrays kept between evaluations [bytes]."""
        own = (self.reference_sums, self.tensors, self._values, self._slopes, *self._rows)
        return self.search.bytes + sum(array.nbytes for array in own)

    @property
    def operations(self) -> Sequence[Operations]:
        """Operations of one evaluation, with the initial neighbours."""
        n, d = self.body.particles.positions.shape
        way = SumMethod.FORMULAS if isinstance(self.sums, PointwiseSums) else SumMethod.WEIGHTS
        return (Operations(way, self.pair_count, n, self.bytes + vectors(n, d), self.bytes),)

    def forces(self, displacements: Array, out: Array) -> None:
        """Forces (n, d) from displacements (n, d) if no term changes the stress."""
        self._stress(displacements)
        self._spread(out)

    def stress(self, displacements: Array, out: Array) -> None:
        """Stress (d, d, n) from displacements (n, d); ghosts have none."""
        self._stress(displacements)
        out[...] = np.moveaxis(self.tensors, 0, -1)

    def spread(self, stress: Array, out: Array) -> None:
        """Forces (n, d) from stress (d, d, n), at the last displacements of `stress`."""
        self.tensors[...] = np.moveaxis(stress, -1, 0)
        if not self.body.formulation.divergence.uses_ghost_stress:
            self.tensors[self.body.particles.ghosts] = 0.0
        self._spread(out)

    def gradient_of(self, displacements: Array, out: Array) -> None:
        """Gradients H (n, d, d) of displacements (n, d); those of ghosts are meaningless."""
        self._gradients(displacements)
        out[...] = self.tensors

    def _stress(self, displacements: Array) -> None:
        self._gradients(displacements)
        self.law(self.tensors, self.body.material.params)
        self.tensors[self.body.particles.ghosts] = 0.0

    def _gradients(self, displacements: Array) -> None:
        particles = self.body.particles
        positions = particles.positions + displacements
        sums = self._searched(positions)
        # As in the matrix engine, volumes follow the crowding relative to the reference.
        with np.errstate(all="ignore"):
            crowding = self.reference_sums / sums
        cells, volumes = particles.cells * crowding, particles.volumes * crowding
        self._place = Place(self._rows, positions, cells, volumes)
        self.sums.gradients(self._place, displacements, self.tensors)

    def _spread(self, out: Array) -> None:
        assert self._place is not None, "stress comes first"
        self.sums.forces(self._place, self.tensors, out)
        if self.body.formulation.divergence.uses_ghost_stress:
            # Ghosts have acted through their stress; no force acts on them.
            out[self.body.particles.ghosts] = 0.0

    def _searched(self, positions: Array) -> Array:
        """Search the neighbours at `positions`, fill the rows, and return the kernel sums, (n,)."""
        particles = self.body.particles
        near = self.search.near(positions)
        room = len(near.columns)
        if len(self._values) != room:
            self._values, self._slopes = np.empty(room), np.empty(room)
            self._rows = Neighbourhoods.with_room(particles.count, room)
        self.kernel(near, self._values, self._slopes)
        fill(near, self._slopes, self._rows)
        sums = np.empty(particles.count)
        kernel_sums(near, self._values, self._own_value, particles.cells, sums)
        return sums


def moving_body(body: Body, law: Any) -> MovingBody:
    """A body with its compiled law (H, params) -> T, prepared."""
    try:
        sums: PointwiseSums | WeightedSums = PointwiseSums.of(body)
    except NotCompilableError:
        sums = WeightedSums(body.formulation)
    return MovingBody(
        body=body,
        law=_law_loop(body.particles.dimension, law),
        search=NeighbourSearch(body.smoothing.support_radius, body.hidden),
        kernel=kernel_pass(body.smoothing),
        sums=sums,
    )


@cache
def _law_loop(dimension: int, law: Any) -> Any:
    matrix = MATRIX[dimension]

    @njit(error_model="numpy")
    def loop(tensors, params):
        for p in range(len(tensors)):
            T = law(matrix(tensors, p), params)
            for i in range(dimension):
                for k in range(dimension):
                    tensors[p, i, k] = T[i][k]

    return loop
