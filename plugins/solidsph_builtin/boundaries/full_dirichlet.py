"""A smoothed boundary value imposed at the boundary and at every ghost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
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
class FullDirichlet(BoundaryHandler):
    """Solve W_BG,BG u_new = u_BG - W_BG,I u_I, so that the approximation equals the given value at
    the boundary and its smooth extension at the ghosts.

    Ismail & Reddy, eq. 11, with the contribution of the interior, which the printed matrix
    omits. Exact, but badly conditioned: for comparison with `exact-dirichlet`.
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
        return [smoothed_value(self, "full-dirichlet", _FullSolve.of, model, label)]


@final
@attrs.frozen(eq=False)
class _FullSolve(Solve):
    """W_BG,BG u_new = u_BG - W_BG,I u_I."""

    square: SuperLU  # of W_BG,BG

    @classmethod
    def of(cls, square: csr_array, boundary_count: int) -> _FullSolve:
        return cls(factorised(square, "full-dirichlet"))

    def values(self, smooth: Array, interior: Array, target: Array) -> Array:
        return self.square.solve(smooth - interior)

    def transposed(self, forces: Array) -> tuple[Array, Array]:
        carried = solved_transposed(self.square, forces)
        return carried, -carried
