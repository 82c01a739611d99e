"""Law: the constitutive law of one body, evaluated between the two passes over its pairs."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.memory import Memory
from solidsph.maths.arrays import Array


class Law(ABC):
    """Stress and history of one body as functions of the displacement gradient."""

    body: Body

    @abstractmethod
    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        """The formulation's flux (d, d, n) [Pa], and the history (n, k) after the step.

        Args:
            H: displacement gradients at the end of the step, (n, d, d).
            history: internal variables at its beginning, (n, k); must not be changed.
            step: length of the step [s]; 0 leaves the history as it is.
        """

    def history_of(self, memory: Memory) -> Array:
        """Internal variables (n, k) in `memory`, or those of the virgin state."""
        name = memory_name(self.body)
        if name in memory:
            return memory[name]
        n, d = self.body.particles.positions.shape
        material = self.body.material
        start = material.initial_history(d) if isinstance(material, HistoryMaterial) else {}
        return np.tile(np.array([*start.values()], dtype=np.float64), (n, 1))


def memory_name(body: Body) -> str:
    """Name of the internal variables of a body in `State.memory`."""
    return f"history of {body.name}"
