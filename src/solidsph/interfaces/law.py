"""Law: how a body's material is asked for its stress, between the two passes over its pairs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.history import HistoryMaterial
from solidsph.maths.arrays import Array


class Law(ABC):
    """What one body answers to the gradients of its displacements."""

    body: Body

    @abstractmethod
    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        """What the divergence is taken of, (d, d, n) [Pa], and the history (n, k) after the step.

        Args:
            H: gradient of the displacements, (n, d, d).
            history: internal variables at its beginning, (n, k); they are not written on.
            step: its length [s]; 0 leaves the history as it is.
        """

    def history_of(self, memory: Mapping[str, Array]) -> Array:
        """The internal variables, (n, k): those remembered, or the virgin state's."""
        name = memory_name(self.body)
        if name in memory:
            return memory[name]
        n, d = self.body.particles.positions.shape
        material = self.body.material
        start = material.initial_history(d) if isinstance(material, HistoryMaterial) else {}
        return np.tile(np.array([*start.values()], dtype=np.float64), (n, 1))


def memory_name(body: Body) -> str:
    """Where the history of a body is in `State.memory`."""
    return f"history of {body.name}"
