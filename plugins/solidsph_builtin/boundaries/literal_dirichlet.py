"""The paper's boundary condition as it is printed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

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
    """Solve W_BG,BG u_new = u_BG, without the contribution of the interior.

    Ismail & Reddy, eq. 11 to the letter. The approximation misses the boundary value by that
    contribution. The handler exists to show this, and reports it as the miss.
    """

    where: Where  # boundary particles
    displacement: Mapping[str, Component] = formula()  # such as {x = "0.1*Y"} [m]
    ghosts: Where = "ghosts"  # those that may change with them
    extension: Mapping[str, Component] | None = formula(default=None)  # at ghosts; else reflected

    example: ClassVar[Mapping[str, Any]] = {
        "where": "left",
        "displacement": {"x": "0.002*sin(300*t)"},
    }

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [smoothed_value(self, "literal-dirichlet", _LiteralSolve.of, model, label)]


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
