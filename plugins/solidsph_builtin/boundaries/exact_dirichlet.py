"""A smoothed boundary value imposed exactly, by the smallest change."""

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
from solidsph_builtin.boundaries._dirichlet import Solve, factorised, smoothed_value


@final
@attrs.frozen
class ExactDirichlet(BoundaryHandler):
    """The smallest change of boundary and ghost values from a smooth extension that makes the
    approximation exact at the boundary particles.

    Ismail & Reddy, section 2.3, amended: the paper's solve for every boundary and ghost value is
    badly conditioned and spoils the approximation beside the boundary.
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
        return [smoothed_value(self, "exact-dirichlet", _MinimumNorm.of, model, label)]


@final
@attrs.frozen(eq=False)
class _MinimumNorm(Solve):
    """Smallest d with A (smooth + d) = target - interior, A the boundary's rows of W."""

    rows: csr_array  # A, (b, b + g)
    normal: SuperLU  # of A A^T, (b, b)

    @classmethod
    def of(cls, square: csr_array, boundary_count: int) -> _MinimumNorm:
        rows = csr_array(square[:boundary_count])
        return cls(rows, factorised(csr_array(rows @ rows.T), "exact-dirichlet"))

    def values(self, smooth: Array, interior: Array, target: Array) -> Array:
        wanted = target - interior[: len(target)]
        values = smooth
        # A A^T squares the condition number of A; the second pass recovers the lost digits.
        for _ in range(2):
            values = values + self.rows.T @ self.normal.solve(wanted - self.rows @ values)
        return values

    def transposed(self, forces: Array) -> tuple[Array, Array]:
        multipliers = self.normal.solve(self.rows @ forces)
        interior = np.zeros_like(forces)
        interior[: len(multipliers)] = -multipliers
        return forces - self.rows.T @ multipliers, interior
