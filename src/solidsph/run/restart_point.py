"""RestartPoint: the output of an earlier run from which a run continues."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import attrs

from solidsph.maths.arrays import Array
from solidsph.model.particles import State


@attrs.frozen(eq=False)
class RestartPoint:
    """Output of an earlier run in the same record, from which a run continues."""

    state: State | None = None  # None: the run is repeated from its initial state
    kept: Mapping[str, Array] = attrs.field(
        factory=dict
    )  # arrays that listeners stored with `state`
    until: float = inf  # outputs up to this time stay in the record [s]
    notes: Sequence[str] = ()  # events of the run, one line each
    repeats: bool = True  # whether repeated outputs must equal those in the record
