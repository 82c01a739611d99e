"""A pressure that follows the surface it acts on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array, kron

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Observation, SurfaceLoad, Term
from solidsph.maths.arrays import Array, Indices
from solidsph.maths.tensors import cofactor, components_first, particles_first
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
        field = VectorField.of({"x": self.pressure}, "pressure: pressure", end=model.end)
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
class FollowerLoad(SurfaceLoad):
    """Pressure times current area on each surface particle."""

    label: str
    particles: Indices  # (k,)
    reference: Array  # X (n, d)
    face: Face
    field: VectorField
    gradients: Sequence[csr_array]  # along each axis, (k, n) [1/m]

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        p = self.field.values(0, self.reference[self.particles], time)
        return -p[:, None] * self._areas(positions)

    def _areas(self, positions: Array) -> Array:
        return self._areas_of(self._deformation(positions))

    def _deformation(self, positions: Array) -> Array:
        """F (d, d, k) of the surface particles."""
        u = positions - self.reference
        H = np.stack([gradient @ u for gradient in self.gradients], axis=-1)
        return components_first(H + np.eye(u.shape[1]))

    def _areas_of(self, F: Array) -> Array:
        """cof(F) N A, (k, d) [m^(d-1)]."""
        cof = particles_first(cofactor(F), len(self.particles))
        return np.asarray(np.einsum("kij,kj->ki", cof, self.face.area_vectors))

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """K (d n, d n) [N/m]; it is symmetric if the surface is closed, or its edge held."""
        n, d = displacements.shape
        p = self.field.values(0, self.reference[self.particles], time)
        F = self._deformation(self.reference + displacements)
        chosen = csr_array(
            (np.ones(len(p)), (self.particles, np.arange(len(p)))), shape=(n, len(p))
        )
        total = csr_array((d * n, d * n))
        for i, j in product(range(d), repeat=2):
            # cof is a polynomial of the second degree: these differences are exact.
            step = np.zeros((d, d, 1))
            step[i, j] = 1.0
            change = 0.5 * (self._areas_of(F + step) - self._areas_of(F - step))
            for k in range(d):
                block = chosen @ (diags_array(p * change[:, k]) @ self.gradients[j])
                place = np.zeros((d, d))
                place[k, i] = 1.0
                total = total + kron(block, place, format="csr")
        return total

    def report(self, observation: Observation) -> Mapping[str, float]:
        state = observation.state
        p = self.field.values(0, self.reference[self.particles], state.time)
        areas = self._areas(state.positions)
        size = np.linalg.norm(areas, axis=1)
        traction = np.einsum(
            "kij,kj->ki", observation.stresses[self.particles], self.face.area_vectors
        )
        against = -float(np.sum(traction * areas / size[:, None]))
        return {
            f"{self.label} asked [Pa]": float(p @ size / size.sum()),
            f"{self.label} particle stress [Pa]": against / float(size.sum()),
        } | asked_resultant(self.label, state.positions[self.particles], -p[:, None] * areas)
