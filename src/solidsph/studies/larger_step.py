"""Larger step: what the configurations of a front would give with the largest safe time step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import attrs

from solidsph.studies.case import Case
from solidsph.studies.cost import SweepSetup
from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point
from solidsph.studies.refinement import judged
from solidsph.studies.variant import with_settings

LARGEST = 0.8
"""Fraction of the critical step, or of the CFL step if that is smaller, that still pays.

From 0.866 on weakly nonlinear forces feed the fastest vibrations, and a run that is beyond 0.85
halves its step as soon as its bodies grow stiffer: with 0.95 `csm3` takes 26 % more steps than with
0.6, with 0.8 a quarter less."""

_FACTOR = "time_step_factor"

ERROR = f"error at {LARGEST} of the critical step"
TIME = f"time at {LARGEST} of the critical step [s]"


@final
@attrs.frozen
class LargerStep:
    """A configuration as it was run, and with the largest safe step."""

    usual: Point
    factor: float  # of the critical step, in use in the usual one
    point: Point

    @property
    def row(self) -> Mapping[str, float]:
        """Error [-] and time [s] with the largest step; infinite where it failed."""
        return {ERROR: self.point.error, TIME: self.point.time}


def at_largest_step(case: Case, made: Frontier, setup: SweepSetup) -> Sequence[LargerStep]:
    """Run the configurations on the front again, with the largest safe time step.

    Nothing is run for equilibria, for scenes that set `time_step`, for those whose factor is as
    large already, and where the sweep varies the factor itself.

    Args:
        case: that of the sweep.
        made: the sweep, with a front by wall time.
        setup: where runs take place and points are kept.
    """
    priced = case.priced()
    factors = {id(point): _factor(priced, point.settings) for point in made.front()}
    usual = [point for point in made.front() if factors[id(point)] < LARGEST]
    grid = [{**point.settings, _FACTOR: LARGEST} for point in usual]
    points = [judged(p, made.limits) for p in setup.points(priced, grid)] if grid else []
    return [
        LargerStep(before, factors[id(before)], after)
        for before, after in zip(usual, points, strict=True)
    ]


def _factor(case: Case, settings: Mapping[str, Any]) -> float:
    """Smallest factor of a configuration's scenes that could be larger; else 1."""
    if _FACTOR in settings:
        return 1.0
    scenes = with_settings(case, settings).scenes().values()
    return min(
        (one.time_step_factor for one in scenes if one.statics is None and one.time_step is None),
        default=1.0,
    )


def larger_step_sentence(made: Sequence[LargerStep]) -> str:
    """What the largest step changes for the most accurate configuration, and what it cost to know;
    empty if nothing was run."""
    if not made:
        return ""
    last, seconds = made[-1], sum(sum(one.point.seconds) for one in made if one.point.finished)
    found = (
        f"{100.0 * last.point.error:.3g} % in {last.point.time:.3g} s"
        if last.point.finished
        else f"no result ({last.point.failure})"
    )
    return (
        f"with {LARGEST:g} of the critical step in place of {last.factor:g}, {last.usual.label()} "
        f"gives {found} in place of {100.0 * last.usual.error:.3g} % in {last.usual.time:.3g} s; "
        f"to know this of the front took {seconds:.3g} s of runs"
    )
