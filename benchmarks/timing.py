"""Time: of what is to be compared with each other, taken in turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any

# A sample shorter than this is mostly what the clock and the scheduler do [s].
_SHORTEST = 2e-3


def alternately(
    runs: Mapping[Any, Callable[[], object]],
    repeats: int,
    of: Callable[[Sequence[float]], float] = median,
) -> dict[Any, float]:
    """Time of each run [s]: the median of `repeats` samples, or what `of` says.

    They take turns, so that a slow moment meets all.
    """
    times: dict[Any, list[float]] = {key: [] for key in runs}
    calls = {key: max(1, int(_SHORTEST / _once(run))) for key, run in runs.items()}
    for _ in range(repeats):
        for key, run in runs.items():
            start = time.perf_counter()
            for _ in range(calls[key]):
                run()
            times[key].append((time.perf_counter() - start) / calls[key])
    return {key: of(values) for key, values in times.items()}


def _once(run: Callable[[], object]) -> float:
    """Time of one run [s], after one that warms caches."""
    run()
    start = time.perf_counter()
    run()
    return time.perf_counter() - start
