"""A dead load on a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.compilable_terms import ScheduledLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, field_arrows
from solidsph.interfaces.terms import Observation, SurfaceLoad, Term
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import Component, VectorField, scheduled_forces
from solidsph.model.particles import Face
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._reports import COMPONENTS, asked_resultant


@final
@attrs.frozen
class Traction(BoundaryHandler):
    """Force per reference area on a face, fixed in direction (a dead load).

    The natural condition of the weak form: each particle receives traction times the area of the
    surface that it owns, so the total force is exactly that on the sampled area. The report has the
    mean traction asked, its resultant and its moment about the origin, and the particle stress, the
    mean of P N at the loaded particles. These are up to half a spacing inside, where the stress
    differs, and linear gradients are one-sided there: the particle stress may be twice, or half,
    the traction asked, though the mean strain is right.
    """

    loads_surface: ClassVar[bool] = True

    where: Where  # a face such as "right", or a condition on the surface
    traction: Mapping[str, Component] = formula()  # such as {x = "5e6*min(t/1e-3, 1)"} [Pa]

    example: ClassVar[Mapping[str, Any]] = {"where": "left", "traction": {"x": "1e3*sin(300*t)"}}

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles, field, face = model.particles, self._field(model), model.surface(self.where)
        indices = face.particles
        for axis in field.components:
            field.values(axis, particles.positions[indices], 0.0)
        return [
            DeadLoad(
                label=label,
                particles=indices,
                positions=particles.positions[indices],
                face=face,
                field=field,
            )
        ]

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        owners = model.surface(self.where).particles
        X = model.particles.positions[owners]
        return (field_arrows(self._field(model), X, "traction", "Pa"),)

    def _field(self, model: DiscreteModel) -> VectorField:
        field = VectorField.of(self.traction, "traction: traction", end=model.end)
        field.check_dimension(model.particles.dimension, "traction")
        return field


@final
@attrs.frozen(eq=False)
class DeadLoad(SurfaceLoad, ScheduledLoad):
    """Traction times area on each surface particle."""

    label: str
    particles: Indices  # (k,)
    positions: Array  # (k, d) reference positions
    face: Face
    field: VectorField

    def schedule(self, times: Array) -> Array:
        return scheduled_forces(self.field, self.positions, self.face.areas, times)

    def report(self, observation: Observation) -> Mapping[str, float]:
        state, total_area = observation.state, self.face.areas.sum()
        P = observation.stresses[self.particles]
        forces = state.applied[self.label][self.particles]
        asked = forces.sum(axis=0) / total_area
        inside = np.einsum("pij,pj->i", P, self.face.area_vectors) / total_area
        columns: dict[str, float] = {}
        for k, name in enumerate(COMPONENTS[: len(asked)]):
            columns[f"{self.label} asked {name} [Pa]"] = float(asked[k])
            columns[f"{self.label} particle stress {name} [Pa]"] = float(inside[k])
        x = state.positions[self.particles]
        return columns | asked_resultant(self.label, x, forces)
