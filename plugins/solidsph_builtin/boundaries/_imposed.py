"""A motion imposed on chosen particles, component by component."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import attrs
import numpy as np

from solidsph.arrays import Array, Indices, Mask
from solidsph.interfaces.condition import MotionCondition, Observation
from solidsph.motion import VectorField
from solidsph.particles import Face
from solidsph.setting import Setting
from solidsph_builtin.boundaries._reports import reaction, stress_reaction


@final
@attrs.frozen(eq=False)
class ImposedMotion(MotionCondition):
    """u = field(X, t) on some particles, in the components that the field has."""

    label: str
    indices: Indices  # (k,)
    positions: Array  # (n, d) reference positions of all particles
    field: VectorField
    step_size: float  # of the run [s]
    stressed_face: Face | None  # of these particles, where the reaction must be read off the stress

    @property
    def held(self) -> Mask:
        held = np.zeros(self.positions.shape, dtype=np.bool_)
        for axis in self.field.components:
            held[self.indices, axis] = True
        return held

    def impose(self, time: float, derivative: int, values: Array) -> None:
        X = self.positions[self.indices]
        for axis in self.field.components:
            values[self.indices, axis] = self.field.derivative(
                axis, X, time, derivative, self.step_size
            )

    def report(self, observation: Observation) -> Mapping[str, float]:
        if self.stressed_face is not None:
            return stress_reaction(observation, self.label, self.stressed_face)
        return reaction(observation, self.label)


def imposed_motion(
    setting: Setting, label: str, indices: Indices, field: VectorField
) -> ImposedMotion:
    """Impose `field` on the particles `indices` of a setting."""
    particles = setting.particles
    by_stress = any(
        body.formulation.divergence.uses_ghost_stress and body.particles.ghosts.any()
        for body in setting.bodies
    )
    return ImposedMotion(
        label=label,
        indices=indices,
        positions=particles.positions,
        field=field,
        step_size=setting.step_size,
        stressed_face=Face(indices, particles.area_vectors[indices]) if by_stress else None,
    )
