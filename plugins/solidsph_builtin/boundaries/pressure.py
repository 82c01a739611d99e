"""A pressure that follows the surface it acts on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array, kron

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.deformation_load import DeformationLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, largest_arrows
from solidsph.interfaces.terms import Observation, SurfaceLoad, Term
from solidsph.maths.arrays import Array, Indices, Scalar, Tensor, Vector
from solidsph.maths.tensors import cofactor, dot, scaled
from solidsph.model.fields import Component, VectorField
from solidsph.model.particles import Face
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._reports import asked_resultant
from solidsph_builtin.effects._gradients import BodyGradient, in_the_reference


@final
@attrs.frozen
class Pressure(BoundaryHandler):
    """f = -p cof(F) N A: force per current area, along the current normal (a follower load).

    Nanson's formula, n da = cof(F) N dA, with F of the particle that owns the surface. The total
    force follows the deformed surface, so it turns with the body; in general it has no energy.
    """

    loads_surface: ClassVar[bool] = True

    where: Where  # a face such as "inner", or a condition on the surface
    pressure: Component = formula()  # p such as "5e6*min(t/1e-3, 1)", positive when it pushes [Pa]

    example: ClassVar[Mapping[str, Any]] = {"where": "left", "pressure": "1e3*sin(300*t)"}

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles = model.particles
        in_the_reference(model, "pressure")
        field = self._field(model)
        face = model.surface(self.where)
        field.values(0, particles.positions[face.particles], 0.0)
        return [
            FollowerLoad(
                label=label,
                particles=face.particles,
                reference=particles.positions,
                face=face,
                field=field,
                gradients=_gradients(model, face.particles),
            )
        ]

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        field, face = self._field(model), model.surface(self.where)
        X, N = model.particles.positions[face.particles], face.area_vectors
        lengths = np.linalg.norm(N, axis=1, keepdims=True)  # 0 where opposite faces meet
        normals = np.divide(N, lengths, out=np.zeros_like(N), where=lengths > 0.0)

        def vectors(time: float) -> Array:
            return np.asarray(-field.values(0, X, time)[:, None] * normals)

        end = model.end if field.varies(0) else 0.0
        return (largest_arrows(vectors, end, X, "pressure", "Pa"),)

    def _field(self, model: DiscreteModel) -> VectorField:
        return VectorField.of({"x": self.pressure}, "pressure: pressure", end=model.end)


def _gradients(model: DiscreteModel, chosen: Indices) -> Sequence[csr_array]:
    """Derivatives at the chosen particles from displacements of all, (k, n) along each axis."""
    blocks = [BodyGradient.of(body).matrices.gradient for body in model.bodies]
    d = model.particles.dimension
    gradients = []
    for axis in range(d):
        rows = [block[axis * block.shape[1] : (axis + 1) * block.shape[1]] for block in blocks]
        gradients.append(csr_array(csr_array(block_diag(rows, format="csr"))[chosen]))
    return gradients


@final
@attrs.frozen(eq=False)
class FollowerLoad(SurfaceLoad, DeformationLoad):
    """Pressure times current area on each surface particle."""

    label: str
    particles: Indices  # (k,)
    reference: Array  # X (n, d)
    face: Face
    field: VectorField
    gradients: Sequence[csr_array]  # along each axis, (k, n) [1/m]

    @property
    def values(self) -> Array:
        return self.face.area_vectors

    def schedule(self, times: Array) -> Array:
        return self.field.schedule(0, self.reference[self.particles], times)

    @staticmethod
    def force(F: Tensor, number: Scalar, values: Vector) -> Vector:
        return scaled(-number, _area(F, values))

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """K (d n, d n) [N/m]; it is symmetric if the surface is closed, or its edge held."""
        n, d = displacements.shape
        p = self.field.values(0, self.reference[self.particles], time)
        F, areas = self.deformation(displacements), self.face.area_vectors.T
        chosen = csr_array(
            (np.ones(len(p)), (self.particles, np.arange(len(p)))), shape=(n, len(p))
        )
        total = csr_array((d * n, d * n))
        for i, j in product(range(d), repeat=2):
            # cof is a polynomial of the second degree: these differences are exact.
            step = np.zeros((d, d, 1))
            step[i, j] = 1.0
            ahead, behind = np.array(_area(F + step, areas)), np.array(_area(F - step, areas))
            change = 0.5 * (ahead - behind)
            for k in range(d):
                block = chosen @ (diags_array(p * change[k]) @ self.gradients[j])
                place = np.zeros((d, d))
                place[k, i] = 1.0
                total = total + kron(block, place, format="csr")
        return total

    def report(self, observation: Observation) -> Mapping[str, float]:
        state = observation.state
        p = self.field.values(0, self.reference[self.particles], state.time)
        F = self.deformation(state.positions - self.reference)
        areas = np.column_stack(_area(F, self.face.area_vectors.T))
        size = np.linalg.norm(areas, axis=1)
        traction = np.einsum(
            "kij,kj->ki", observation.stresses[self.particles], self.face.area_vectors
        )
        against = -float(np.sum(traction * areas / size[:, None]))
        return {
            f"{self.label} asked [Pa]": float(p @ size / size.sum()),
            f"{self.label} particle stress [Pa]": against / float(size.sum()),
        } | asked_resultant(self.label, state.positions[self.particles], -p[:, None] * areas)


def _area(F: Tensor, area: Vector) -> Vector:
    """cof(F) N A [m^(d-1)]."""
    cof = cofactor(F)
    if len(area) == 1:
        return (dot(cof[0], area),)
    if len(area) == 2:
        return (dot(cof[0], area), dot(cof[1], area))
    return (dot(cof[0], area), dot(cof[1], area), dot(cof[2], area))
