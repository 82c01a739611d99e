"""RestartPoint: where an earlier run is gone on from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import attrs

from solidsph.maths.arrays import Array
from solidsph.model.particles import State


@attrs.frozen(eq=False)
class RestartPoint:
    """What a run takes over from an earlier one that was recorded in the same file."""

    state: State | None = None  # an output to go on from; None: all is carried out again
    kept: Mapping[str, Array] = attrs.field(factory=dict)  # what listeners had kept at `state`
    until: float = inf  # the record's outputs up to this time stay [s]
    notes: Sequence[str] = ()  # what happened to the run, one line each
    repeats: bool = True  # whether outputs that are in the record must come out the same again
