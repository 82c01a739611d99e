"""Increment: a load step that is being solved, from what the bodies remember of those before it."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.memory import NOTHING, Memory
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array


@final
@attrs.frozen(eq=False)
class Increment:
    """A part of the load path, from an equilibrium to the next."""

    factor: float  # load factor at its end
    time: float  # at its end [s]
    step: float  # its length in time [s]; 0 leaves internal variables as they are
    memory: Memory  # at its beginning
    start: Array | None = None  # displacements at its beginning, (n, d) [m]; None if at rest

    def velocities(self, load: Load, displacements: Array) -> Array:
        """Velocities that a load is to see at displacements (n, d) at its end, (n, d) [m/s]."""
        if self.start is None or self.step == 0.0 or not load.rate_independent:
            return np.zeros_like(displacements)
        return np.asarray((displacements - self.start) / self.step)


AT_REST = Increment(0.0, 0.0, 0.0, NOTHING)
"""No load step, of bodies that remember nothing yet."""
