"""Refine a scene until its error bar is known to be small enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import inf, isfinite, log, sqrt
from typing import final

import attrs

from solidsph.studies.limit import Limit
from solidsph.studies.point import Point
from solidsph.studies.refinement import LEAST, TooFewError, judged, limits
from solidsph.studies.scene_case import SPACING
from solidsph.studies.search import Goal, Settings

# From one spacing to the next, and how often beyond the finest that is given.
_RATIO = sqrt(2.0)
_EXTENSIONS = 6

# Order of the time in the spacing until two have been run, and its limits.
_GROWTH, _GROWTHS = 3.0, (0.5, 5.0)

# Steps of the spacings to choose from, once it is known what they tend to.
_STEP = 2.0**0.25


@final
@attrs.frozen
class Refined:
    """Points of one scheme from coarse to fine, and what they tend to."""

    points: Sequence[Point]  # with estimated errors
    limits: Sequence[Limit]
    spacings: Sequence[float]  # to choose from, those of the points included [m]


def refine(
    spacings: Sequence[float],
    scheme: Settings,
    goal: Goal,
    run: Callable[[Settings], Point],
    *,
    longest: float,
) -> Refined:
    """Run one scheme at finer and finer spacings until the error bar of the finest meets `goal`.

    For a time as the goal, until a finer one would take longer.

    Args:
        spacings: to begin with, from coarse to fine [m].
        scheme: all other settings.
        goal: what is searched for.
        run: measures a configuration.
        longest: predicted wall time above which nothing is run [s].

    Raises:
        TooFewError: fewer than three spacings have finished.
    """
    points: list[Point] = []
    tried: list[float] = []
    for spacing in _finer(spacings):
        expected = _predicted(points, spacing)
        if expected > min(longest, goal.time):
            if sum(point.ran for point in points) < LEAST:
                raise TooFewError(
                    f"an error bar needs {LEAST} spacings, and {len(points)} ran: the next, "
                    f"{spacing:.4g} m, is expected to take {expected:.2g} s, and "
                    f"{min(longest, goal.time):.2g} s are allowed; allow more, or begin with "
                    "coarser ones: --axis spacing=..."
                )
            break
        points.append(run({SPACING: spacing, **scheme}))
        tried.append(spacing)
        if len(tried) >= len(spacings) and _is_enough(points, goal):
            break
    known = limits(points, SPACING)
    return Refined([judged(point, known) for point in points], known, list(_ladder(tried)))


def _is_enough(points: Sequence[Point], goal: Goal) -> bool:
    """Whether the finest point has the accuracy that is asked for."""
    if sum(point.ran for point in points) < LEAST:
        return False
    return max(limit.bar for limit in limits(points, SPACING)) <= goal.error < inf


def _finer(spacings: Sequence[float]) -> Iterator[float]:
    yield from spacings
    finest = spacings[-1]
    for level in range(1, _EXTENSIONS + 1):
        yield float(f"{finest / _RATIO**level:.4g}")


def _ladder(tried: Sequence[float]) -> Iterator[float]:
    """Those spacings, and further ones between them in small steps."""
    for coarse, fine in pairwise(tried):
        yield coarse
        steps = round(log(coarse / fine) / log(_STEP))
        for step in range(1, steps):
            yield float(f"{coarse * (fine / coarse) ** (step / steps):.4g}")
    yield tried[-1]


def _predicted(points: Sequence[Point], spacing: float) -> float:
    """Predicted wall time at a spacing [s]; 0 before anything has run."""
    done = [point for point in points if point.ran and isfinite(point.spacing)]
    if not done:
        return 0.0
    last, growth = done[-1], _GROWTH
    if len(done) > 1 and done[-2].spacing > last.spacing:
        found = log(last.time / done[-2].time) / log(done[-2].spacing / last.spacing)
        growth = min(max(found, _GROWTHS[0]), _GROWTHS[1])
    return float(last.time * (last.spacing / spacing) ** growth)
