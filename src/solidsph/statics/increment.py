"""Increment: a load step that is being solved, from what the bodies remember of those before it."""

from __future__ import annotations

from typing import final

import attrs

from solidsph.interfaces.memory import NOTHING, Memory


@final
@attrs.frozen(eq=False)
class Increment:
    """A part of the load path, from an equilibrium to the next."""

    factor: float  # load factor at its end
    time: float  # at its end [s]
    step: float  # its length in time [s]; 0 leaves internal variables as they are
    memory: Memory  # at its beginning


AT_REST = Increment(0.0, 0.0, 0.0, NOTHING)
"""No load step, of bodies that remember nothing yet."""
