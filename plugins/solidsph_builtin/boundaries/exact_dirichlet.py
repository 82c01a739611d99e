"""A smoothed boundary value imposed exactly, by the smallest change."""

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
from solidsph_builtin.boundaries._dirichlet import Solve, factorised, smoothed_value


@final
@attrs.frozen
class ExactDirichlet(BoundaryHandler):
    """Changes boundary and ghost values as little as possible from a smooth extension, so that the
    approximation at the boundary particles is exact.

    Ismail & Reddy, section 2.3, amended: solving for every boundary and ghost value, as the
    paper has it, is badly conditioned and spoils the approximation beside the boundary.
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
                handler="exact-dirichlet",
                solve=_MinimumNorm.of,
            )
        ]


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
        # A A^T squares the condition number of A; the second pass wins the lost digits back.
        for _ in range(2):
            values = values + self.rows.T @ self.normal.solve(wanted - self.rows @ values)
        return values

    def transposed(self, forces: Array) -> tuple[Array, Array]:
        multipliers = self.normal.solve(self.rows @ forces)
        interior = np.zeros_like(forces)
        interior[: len(multipliers)] = -multipliers
        return forces - self.rows.T @ multipliers, interior
