"""Cost of accuracy: a sweep of a case over axes, or a search for an accuracy or a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case
from solidsph.studies.frontier import Frontier
from solidsph.studies.journal import Journal
from solidsph.studies.part_values import check_parts
from solidsph.studies.point import Point
from solidsph.studies.processes import Processes
from solidsph.studies.refine import refine
from solidsph.studies.refinement import LEAST, TooFewError, judged, limits, needs_estimate
from solidsph.studies.runner import Runner
from solidsph.studies.scene_case import SPACING, SceneCase
from solidsph.studies.scene_words import is_of_the_scheme
from solidsph.studies.search import Goal, SearchResult, Settings, own_scheme, search
from solidsph.studies.sweep import StatusCallback, sweep
from solidsph.studies.sweep_progress import default_watch
from solidsph.studies.task import Task
from solidsph.studies.variant import setting_of, with_settings

Axes = Mapping[str, Sequence[Any]]

JOURNAL = "points.jsonl"


@attrs.frozen
class SweepSetup:
    """Where and how often configurations are run, and where their points are kept."""

    runner: Runner = attrs.field(factory=lambda: Processes(1))
    folder: Path | None = None  # of the journal; None keeps nothing
    repeats: int = 1  # of every configuration; times are medians
    watch: StatusCallback = attrs.field(factory=default_watch)  # in notebooks a display

    def points(self, case: Case, grid: Sequence[Settings]) -> Sequence[Point]:
        """Points of `case` with each of these settings; from the journal if it has them."""
        tasks = [
            Task(case, settings, repeat) for settings in grid for repeat in range(self.repeats)
        ]
        with ExitStack() as stack:
            folder = self.folder or Path(stack.enter_context(TemporaryDirectory()))
            return sweep(tasks, self.runner, Journal(folder / JOURNAL), self.watch)


def frontier(
    case: Case | Scene | str, axes: Axes | None = None, setup: SweepSetup | None = None
) -> Frontier:
    """Run `case` at every combination of the values of `axes`, and at its own parameters.

    Args:
        case: a case or its registered name, or a scene, whose probes are measured. Where there is
            no reference, errors are estimated by refinement (`Frontier.limits`).
        axes: parameters of the case, or keys of any scene, with the values to try. The first one
            refines, from coarse to fine. By default those of the case.
        setup: by default one process at a time and one repeat, and nothing is kept.

    Raises:
        SceneError: there is no such axis, or nothing to sweep; or an error is to be estimated and
            fewer than three spacings are given.
    """
    priced, axes = _priced(case, axes)
    refining = next(iter(axes))
    grid: list[Settings] = [
        dict(zip(axes, values, strict=True)) for values in product(*axes.values())
    ]
    own = default_settings(priced, axes)
    if own is not None and own not in grid:
        grid.append(own)
    spacings = {settings[refining] for settings in grid} if refining == SPACING else ()
    if isinstance(priced, SceneCase) and not priced.references and 0 < len(spacings) < LEAST:
        raise SceneError(
            f"an error bar needs {LEAST} spacings, and there are {len(spacings)}; give more by "
            "--axis spacing=..., or a --reference"
        )
    points = (setup or SweepSetup()).points(priced, grid)
    if not needs_estimate(points):
        return Frontier(points, refining)
    try:
        known = limits(points, refining)
    except TooFewError as cause:
        return Frontier(points, refining, unjudged=str(cause))
    return Frontier([judged(point, known) for point in points], refining, known)


def find_best(
    case: Case | Scene | str,
    goal: Goal,
    axes: Axes | None = None,
    setup: SweepSetup | None = None,
    *,
    longest: float = 600.0,
) -> SearchResult:
    """The best configuration for `goal`, by few runs; see `search`.

    Where there is no reference, the case's own scheme is refined first, until its error bar is
    small enough to tell; what it tends to then stands for the reference.

    Raises:
        SceneError: there is no such axis.
    """
    priced, axes = _priced(case, axes)
    how = setup or SweepSetup()

    def run(settings: Settings) -> Point:
        (point,) = how.points(priced, [settings])
        return point

    if not isinstance(priced, SceneCase) or priced.references:
        return search(priced, axes, goal, run, longest=longest)
    return _find_without_reference(priced, axes, goal, run, longest)


def _find_without_reference(
    case: SceneCase, axes: Axes, goal: Goal, run: Callable[[Settings], Point], longest: float
) -> SearchResult:
    """Refine the scene's own scheme, then search with errors against what it tends to."""
    refining, *others = axes
    schemes = [
        dict(zip(others, values, strict=True)) for values in product(*(axes[o] for o in others))
    ]
    scheme = {**schemes[0], **own_scheme(case, others, schemes)}
    kept: dict[str, Point] = {}

    def run_once(settings: Settings) -> Point:
        key = repr(sorted(settings.items()))
        if key not in kept:
            kept[key] = run(settings)
        return kept[key]

    try:
        refined = refine(axes[refining], scheme, goal, run_once, longest=longest)
    except TooFewError as cause:
        return SearchResult(None, list(kept.values()), str(cause))
    levels = refined.spacings if axes[refining] == case.sweep[refining] else axes[refining]
    found = search(
        case,
        {**axes, refining: levels},
        goal,
        lambda settings: judged(run_once(settings), refined.limits),
        longest=longest,
        known=refined.points,
    )
    return attrs.evolve(
        found,
        tried=[judged(point, refined.limits) for point in kept.values()],
        limits=refined.limits,
    )


def sweep_of(case: Case) -> Axes:
    """Axes of a case.

    Raises:
        SceneError: it has none.
    """
    if not case.sweep:
        raise SceneError(
            f"{case.title!r} names no parameter that trades accuracy for time; give --axis "
            "name=values"
        )
    return case.sweep


def default_settings(case: Case, axes: Axes) -> Settings | None:
    """The case's own values of these axes; None if it has no such value."""
    try:
        return {axis: setting_of(case, axis) for axis in axes}
    except SceneError:
        return None


def _priced(case: Case | Scene | str, axes: Axes | None) -> tuple[Case, Axes]:
    """The case to run, and its axes, whose values have been tried one by one."""
    whole: Case = SceneCase.of(case) if isinstance(case, Scene) else construct("cases", case)
    priced = whole.priced()
    axes = axes or sweep_of(priced)
    for axis, values in axes.items():
        if not values:
            raise SceneError(f"axis {axis!r} has no values; give some")
        for value in values:
            for scene in with_settings(priced, {axis: value}).scenes().values():
                check_parts(scene, f"{axis} = {value!r}")
        unjudged = priced.scene if isinstance(priced, SceneCase) and not priced.references else None
        if unjudged is not None and not is_of_the_scheme(unjudged, axis):
            raise SceneError(
                f"axis {axis!r} says what is simulated, not how: results with different values of "
                "it tend to different limits, and errors cannot be estimated from one. Set a value "
                "by --set, or give a --reference"
            )
    return priced, axes
