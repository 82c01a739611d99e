"""A traction imposed on the smoothed stress at the boundary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, field_arrows
from solidsph.interfaces.terms import Observation, StressTerm, Term
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._dirichlet import factorised
from solidsph_builtin.boundaries._images import interpolation
from solidsph_builtin.boundaries._reports import COMPONENTS, asked_resultant
from solidsph_builtin.boundaries.ghost_extension import chosen_ghosts


@final
@attrs.frozen
class ApproximateNeumann(BoundaryHandler):
    """<P> N = traction at the boundary particles, by the smallest change of the stress there.

    The gradient itself cannot be imposed, because dW/dr = 0 at r = 0. So the condition holds for a
    second approximation, of the stress computed from it (Ismail & Reddy, section 2.3). It is exact
    in one dimension. In more it is approximate: near an edge a particle has one normal where the
    surface has two, and only the component along the normal is imposed. Ghosts must be moved by
    another handler, such as `ghost-extension`.
    """

    loads_surface: ClassVar[bool] = True

    where: Where  # a face such as "left", or a condition on the surface
    traction: Mapping[str, Component] = formula()  # such as {x = 0, y = "-1e5"} [Pa]
    ghosts: Where = "ghosts"  # those whose stress may change with it

    example: ClassVar[Mapping[str, Any]] = {"where": "left", "traction": {"x": "1e3*sin(300*t)"}}

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles, field, face = model.particles, self._field(model), model.surface(self.where)
        boundary, area_vectors = face.particles, face.area_vectors
        ghosts = chosen_ghosts(model, self.ghosts, "approximate-neumann")
        normals = area_vectors / np.linalg.norm(area_vectors, axis=1)[:, None]
        smoothing = csr_array(model.smoothing_matrix()[boundary])
        rows = csr_array(smoothing[:, np.concatenate([boundary, ghosts])])
        # Stress changes y_b (x) N_b W_bq: their products with N_c make the Gram matrix of normals.
        gram = csr_array((rows @ rows.T).multiply(csr_array(normals @ normals.T)))
        return [
            SmoothedTraction(
                label=label,
                positions=particles.positions,
                boundary=boundary,
                ghosts=ghosts,
                normals=normals,
                areas=face.areas,
                field=field,
                smoothing=smoothing,
                rows=rows,
                normal_equations=factorised(gram, "approximate-neumann"),
                images=interpolation(particles, particles.images[ghosts]),
            )
        ]

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        owners = model.surface(self.where).particles
        X = model.particles.positions[owners]
        return (field_arrows(self._field(model), X, "traction", "Pa"),)

    def _field(self, model: DiscreteModel) -> VectorField:
        field = VectorField.of(self.traction, "approximate-neumann: traction", end=model.end)
        field.check_dimension(model.particles.dimension, "approximate-neumann")
        return field


@final
@attrs.frozen(eq=False)
class SmoothedTraction(StressTerm):
    """<P> N = field(X, t) at the boundary particles."""

    label: str
    positions: Array  # (n, d) reference positions of all particles
    boundary: Indices  # (b,)
    ghosts: Indices  # (g,)
    normals: Array  # (b, d)
    areas: Array  # (b,) [m^(d-1)]
    field: VectorField
    smoothing: csr_array  # (b, n) rows of W
    rows: csr_array  # (b, b + g) its columns of boundary and ghosts
    normal_equations: SuperLU  # (b, b)
    images: csr_array  # (g, n) values at the images of the ghosts

    def impose_stress(self, time: float, stress: Array) -> None:
        chosen = np.concatenate([self.boundary, self.ghosts])
        for row in stress:
            for component in row:
                component[self.ghosts] = self.images @ component
        for axis in self.field.components:
            target = self.field.values(axis, self.positions[self.boundary], time)
            for _ in range(2):  # the second pass recovers the digits that A A^T costs
                missing = target - self._traction(stress, axis)
                change = self.normal_equations.solve(missing)
                for k, component in enumerate(stress[axis]):
                    component[chosen] += self.rows.T @ (change * self.normals[:, k])

    def _traction(self, stress: Array, axis: int) -> Array:
        """Component of <P> N along `axis` at the boundary particles, (b,)."""
        smoothed = self.smoothing @ stress[axis].T
        traction: Array = np.einsum("bk,bk->b", smoothed, self.normals)
        return traction

    def report(self, observation: Observation) -> Mapping[str, float]:
        stress = np.ascontiguousarray(np.moveaxis(observation.stresses, 0, -1))
        time = observation.state.time
        before = [self._traction(stress, axis) for axis in self.field.components]
        self.impose_stress(time, stress)
        X = self.positions[self.boundary]
        columns: dict[str, float] = {}
        asked = np.zeros(X.shape)
        for axis, unset in zip(self.field.components, before, strict=True):
            traction = self.field.values(axis, X, time)
            asked[:, axis] = traction * self.areas
            achieved = self._traction(stress, axis)
            means = {"asked": traction, "achieved": achieved, "unset": unset}
            for name, values in means.items():
                columns[f"{self.label} {name} {COMPONENTS[axis]} [Pa]"] = float(np.mean(values))
        positions = observation.state.positions[self.boundary]
        return columns | asked_resultant(self.label, positions, asked)
