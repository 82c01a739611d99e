"""The paper's boundary condition as it is printed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Term
from solidsph.maths.arrays import Array
from solidsph.model.fields import Component
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._dirichlet import (
    Solve,
    factorised,
    smoothed_value,
    solved_transposed,
)


@final
@attrs.frozen
class LiteralDirichlet(BoundaryHandler):
    """Solves W_BG,BG u_new = u_BG, whatever the interior contributes.

    Ismail & Reddy, eq. 11 to the letter. The approximation misses the boundary value by what the
    interior adds to it: kept to show that, and reported as the miss.
    """

    where: Where  # boundary particles
    displacement: Mapping[str, Component] = formula()  # such as {x = "0.1*Y"} [m]
    ghosts: Where = "ghosts"  # those that may change with them
    extension: Mapping[str, Component] | None = formula(default=None)  # of ghosts; else reflected

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [
            smoothed_value(
                model,
                label,
                where=self.where,
                ghosts=self.ghosts,
                displacement=self.displacement,
                extension=self.extension,
                handler="literal-dirichlet",
                solve=_LiteralSolve.of,
            )
        ]


@final
@attrs.frozen(eq=False)
class _LiteralSolve(Solve):
    """W_BG,BG u_new = u_BG."""

    square: SuperLU  # of W_BG,BG

    @classmethod
    def of(cls, square: csr_array, boundary_count: int) -> _LiteralSolve:
        return cls(factorised(square, "literal-dirichlet"))

    def values(self, smooth: Array, interior: Array, target: Array) -> Array:
        return self.square.solve(smooth)

    def transposed(self, forces: Array) -> tuple[Array, Array]:
        return solved_transposed(self.square, forces), np.zeros_like(forces)
