"""A dead load on a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.arrays import Array, Indices
from solidsph.errors import SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.condition import Condition, Observation, SurfaceLoad
from solidsph.interfaces.declared import ScheduledForce
from solidsph.motion import Component, VectorField, scheduled_forces
from solidsph.particles import Face
from solidsph.setting import Setting
from solidsph.where import Where
from solidsph_builtin.boundaries._reports import COMPONENTS


@final
@attrs.frozen
class Traction(BoundaryHandler):
    """Force per reference area on a face, fixed in direction (a dead load).

    The weak form's own natural condition: each particle receives traction times the area of the
    surface that it owns, so the total force is that of the sampled area. Reported beside it is the
    traction that the stress at those particles balances. That is a harder test: linear gradients
    are one-sided there, and a dead load on a discrete surface leaves the outermost particles with
    up to twice, or half, the stress that it asks for, though the mean strain is right.
    """

    where: Where  # a face such as "right", or any condition that matches surface particles
    traction: Mapping[str, Component]  # such as {x = "5e6*min(t/1e-3, 1)"} [Pa]

    def bind(self, setting: Setting, label: str) -> Sequence[Condition]:
        particles = setting.particles
        field = VectorField.of(self.traction, "traction: traction", end=setting.end)
        field.check_dimension(particles.dimension, "traction")
        face = surface_at(setting, self.where, "traction")
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


def surface_at(setting: Setting, where: Where, handler: str) -> Face:
    """The surface that particles at `where` own: of the face of that name, or of all faces."""
    particles = setting.particles
    if isinstance(where, str) and where in particles.faces:
        return particles.faces[where]
    areas = np.zeros(particles.count)
    for face in particles.faces.values():
        np.add.at(areas, face.particles, face.areas)
    chosen = setting.select(where)
    chosen = chosen[areas[chosen] > 0.0]
    if not len(chosen):
        raise SceneError(
            f"{handler}: no particle at where = {where!r} lies on the surface; name a face: "
            f"{', '.join(particles.faces)}"
        )
    return Face(chosen, particles.area_vectors[chosen], areas[chosen])


@final
@attrs.frozen(eq=False)
class DeadLoad(SurfaceLoad, ScheduledForce):
    """Traction times area on each surface particle."""

    label: str
    particles: Indices  # (k,)
    positions: Array  # (k, d) reference positions
    face: Face
    field: VectorField

    def schedule(self, times: Array) -> Array:
        return scheduled_forces(self.field, self.positions, self.face.areas, times)

    def report(self, observation: Observation) -> Mapping[str, float]:
        total_area = self.face.areas.sum()
        asked = observation.state.applied[self.label].sum(axis=0) / total_area
        P = observation.stresses[self.particles]
        achieved = np.einsum("pij,pj->i", P, self.face.area_vectors) / total_area
        columns: dict[str, float] = {}
        for k, name in enumerate(COMPONENTS[: len(asked)]):
            columns[f"{self.label} asked {name} [Pa]"] = float(asked[k])
            columns[f"{self.label} achieved {name} [Pa]"] = float(achieved[k])
        return columns
