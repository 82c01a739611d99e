"""A motion imposed on chosen particles, component by component."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import attrs
import numpy as np

from solidsph.arrays import Array, Indices, Mask
from solidsph.interfaces.condition import MotionCondition, Observation
from solidsph.motion import VectorField
from solidsph_builtin.boundaries._reports import reaction


@final
@attrs.frozen(eq=False)
class ImposedMotion(MotionCondition):
    """u = field(X, t) on some particles, in the components that the field has."""

    label: str
    indices: Indices  # (k,)
    positions: Array  # (n, d) reference positions of all particles
    field: VectorField
    time_scale: float  # over which the field may vary [s]

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
                axis, X, time, derivative, self.time_scale
            )

    def report(self, observation: Observation) -> Mapping[str, float]:
        return reaction(observation, self.label)
