"""The cheapest configuration for an accuracy, or the most accurate for a time, by few runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import product
from math import inf, isfinite, log
from statistics import median
from typing import Any, TypeAlias, final

import attrs

from solidsph.errors import SceneError
from solidsph.studies.case import Case
from solidsph.studies.limit import Limit
from solidsph.studies.point import Point
from solidsph.studies.variant import setting_of, with_settings
from solidsph.system import html

Settings = Mapping[str, Any]
Axes = Mapping[str, Sequence[Any]]

Place: TypeAlias = tuple[int, int]
"""A configuration, by numbers of its scheme and of its level of refinement."""

# Orders of error and time in the spacing, until two levels of a scheme are known: a high order of
# the error, so that no scheme is given up too soon, and the time of an explicit run in 2D. Then
# their limits.
_ORDER, _GROWTH = 2.5, 3.0
_ORDERS, _GROWTHS = (0.5, 4.0), (0.5, 5.0)

# Part of the shortest run that does not depend on the spacing: building, starting, compiling.
_FIXED = 0.5

_TINY = 1e-300

# A run is worth it if it is predicted to be better than the best by this factor. Its prediction may
# miss the goal by the other.
_GAIN = 1.25
_MISS = 1.2

# Levels by which the refining axis may be extended beyond the values given.
_EXTENSIONS = 6


@final
@attrs.frozen
class Goal:
    """Goal of a search: the least time for an error, or the least error in a time.

    Raises:
        SceneError: neither is given, or both are.
    """

    error: float = inf  # largest, relative [-]
    time: float = inf  # longest wall time [s]

    def __attrs_post_init__(self) -> None:
        if isfinite(self.error) == isfinite(self.time):
            raise SceneError("a goal is an error or a time; give one of them")

    def met(self, point: Point) -> bool:
        """Whether a point is good enough."""
        return point.finished and point.error <= self.error and point.time <= self.time

    def loss(self, error: float, time: float) -> float:
        """Quantity to minimise among points that are good enough."""
        return time if isfinite(self.error) else error

    def promising(self, error: float, time: float) -> bool:
        """Whether a point with this predicted error and time would be good enough."""
        return error <= _MISS * self.error and time <= _MISS * self.time

    def refuted(self, finer: Point) -> bool:
        """Whether a finer point of its scheme shows that a point was good enough by chance."""
        return finer.error > self.error

    def exhausted(self, error: float, time: float) -> bool:
        """Whether no finer point than one with this error and time can be better."""
        return error <= self.error if isfinite(self.error) else time > self.time


@attrs.frozen(repr=False)
class SearchResult:
    """Result of a search."""

    point: Point | None  # the best that meets the goal; None if none does
    tried: Sequence[Point]
    sure: str  # its reliability, in words
    limits: Sequence[Limit] = ()  # what errors are of where there is no reference

    @property
    def spent(self) -> float:
        """Wall time of all runs [s]."""
        return sum(sum(point.seconds) for point in self.tried if isfinite(point.time))

    def __repr__(self) -> str:
        found = "nothing" if self.point is None else self.point.brief()
        return f"SearchResult({found}, by {len(self.tried)} configurations: {self.sure})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        rows = [
            {
                "configuration": point.label(),
                "error [%]": 100.0 * point.error,
                "time [s]": point.time,
                "found": point == self.point,
            }
            for point in self.tried
        ]
        title = "nothing found" if self.point is None else f"found: {self.point.brief()}"
        return html.heading(title, self.sure) + html.of_rows(rows)


def search(
    case: Case,
    axes: Axes,
    goal: Goal,
    run: Callable[[Settings], Point],
    *,
    longest: float = 600.0,
    known: Sequence[Point] = (),
) -> SearchResult:
    """Search for `goal` among the values of `axes`, and beyond the finest if necessary.

    A scheme is a choice of all settings but the refining one. The central scheme and those that
    differ from it in one choice run at their coarsest; each choice is assumed to have the same
    effect on error and time in any combination. Powers of the spacing predict the rest. The most
    promising configuration is run and replaces its prediction, until no other promises enough gain.
    A result that is not better than a coarser one is checked by a finer run, because its error may
    be small by chance.

    Args:
        case: already `priced`.
        axes: values by setting; the first refines, from coarse to fine.
        goal: what is searched for.
        run: measures a configuration.
        longest: predicted wall time above which nothing is run [s].
        known: points that have been run before.

    Raises:
        SceneError: there is no axis.
    """
    if not axes:
        raise SceneError("nothing to search: no axis; give --axis name=values")
    refining, *others = axes
    schemes = [
        dict(zip(others, values, strict=True)) for values in product(*(axes[o] for o in others))
    ]
    state = _Search(case, refining, list(axes[refining]), schemes, goal, longest)
    for earlier in known:
        for at in product(range(len(schemes)), range(len(axes[refining]))):
            if state.settings(at) == earlier.settings:
                state.points[at] = earlier
    while (place := state.next()) is not None:
        state.points[place] = run(state.settings(place))
    best = state.best()
    point = None if best is None else state.points[best]
    return SearchResult(point, list(state.points.values()), state.reliability(best))


def own_scheme(case: Case, names: Iterable[str], schemes: Sequence[Settings]) -> Settings:
    """The case's own values of these settings, those that one of the schemes has."""
    own = {}
    for name in names:
        with suppress(SceneError):
            own[name] = setting_of(case, name)
    return {k: v for k, v in own.items() if any(scheme[k] == v for scheme in schemes)}


@attrs.define(eq=False, slots=False)
class _Search:
    """Points measured so far, and the predictions that follow from them."""

    case: Case
    refining: str
    levels: list[Any]  # values of the refining setting, extended on demand
    schemes: Sequence[Settings]
    goal: Goal
    longest: float
    points: dict[Place, Point] = attrs.field(factory=dict)
    _spacings: dict[Any, float] = attrs.field(factory=dict)
    _most: int = 0  # levels

    def __attrs_post_init__(self) -> None:
        self._most = len(self.levels) + _EXTENSIONS

    def settings(self, place: Place) -> Settings:
        scheme, level = place
        return {self.refining: self.levels[level], **self.schemes[scheme]}

    def best(self) -> Place | None:
        """The best point that meets the goal and is not refuted by a finer one."""
        met = [
            (scheme, level)
            for (scheme, level), point in self.points.items()
            if self.goal.met(point)
            and not any(
                self.goal.refuted(finer)
                for other, finer in self._finished(scheme).items()
                if other > level
            )
        ]
        return min(met, key=self._loss, default=None)

    def next(self) -> Place | None:
        """The next place to run; None if no run is worth it."""
        for scheme in self._star:
            if (scheme, 0) not in self.points:
                return scheme, 0
        best = self.best()
        bound = inf if best is None else self._loss(best) / _GAIN
        offer = min(self._offers(), default=None)
        if offer is not None and offer[0] < bound:
            return offer[1]
        return None if best is None else self._check(*best)

    def _loss(self, place: Place) -> float:
        return self.goal.loss(self.points[place].error, self.points[place].time)

    def _check(self, scheme: int, level: int) -> Place | None:
        """A finer place to check that the best is not good by chance; None if that is known."""
        finished = self._finished(scheme)
        finer = any(other > level for other in finished)
        error = finished[level].error
        if finer or any(p.error > error for other, p in finished.items() if other < level):
            return None
        if self._has(level + 1) and self.predicted(scheme, level + 1)[1] <= self.longest:
            return scheme, level + 1
        return None

    def _offers(self) -> Iterator[tuple[float, Place]]:
        """Predicted loss and place of every promising configuration that has not been run."""
        for scheme in range(len(self.schemes)):
            level = 0
            while self._has(level):
                error, time = self.predicted(scheme, level)
                if time > self.longest:
                    break
                if (scheme, level) not in self.points:
                    if self.goal.promising(error, time):
                        yield self.goal.loss(error, time), (scheme, level)
                    if self.goal.exhausted(error, time):
                        break
                level += 1

    def _has(self, level: int) -> bool:
        """Whether there is such a level; the axis is extended if possible."""
        if level >= len(self.levels) and len(self.levels) < self._most:
            finer = _extension(self.case, self.refining, self.levels)
            if finer is not None:
                self.levels.append(finer)
        return level < len(self.levels)

    def spacing(self, level: int) -> float:
        """Particle spacing at a level [m]."""
        value = self.levels[level]
        if value not in self._spacings:
            self._spacings[value] = with_settings(self.case, {self.refining: value}).resolution
        return self._spacings[value]

    def predicted(self, scheme: int, level: int) -> tuple[float, float]:
        """Error and time of a scheme at a level, measured or extrapolated by powers."""
        if (scheme, level) in self.points:
            here = self.points[scheme, level]
            return here.error, here.time
        finished = self._finished(scheme)
        if not finished and any(other == scheme for other, _ in self.points):
            return inf, inf  # it failed
        nearest = min(finished, key=lambda other: abs(other - level), default=0)
        point = finished.get(nearest)
        error, time = (point.error, point.time) if point else self._by_choices(scheme)
        ratio = self.spacing(level) / self.spacing(nearest)
        times = [p.time for p in self.points.values() if p.finished]
        fixed = _FIXED * min(times, default=0.0)
        growth = self._growth(scheme, fixed)
        return error * ratio ** self._order(finished), fixed + (time - fixed) * ratio**-growth

    def _by_choices(self, scheme: int) -> tuple[float, float]:
        """Error and time of a scheme at its coarsest, from those of its single choices."""
        centre, *star = self._star
        base = self.points[centre, 0]
        error, time = base.error, base.time
        for other in star:
            (axis,) = self._differing(other, centre)
            if self.schemes[scheme][axis] == self.schemes[other][axis]:
                point = self.points[other, 0]
                error *= max(point.error, _TINY) / max(base.error, _TINY)
                time *= point.time / base.time
        return error, time

    @cached_property
    def _star(self) -> Sequence[int]:
        """The case's own scheme, as far as the axes have it, then those that differ from it in one
        choice."""
        own = own_scheme(self.case, self.schemes[0], self.schemes)
        centre = self.schemes.index({**self.schemes[0], **own})
        near = [i for i in range(len(self.schemes)) if len(self._differing(i, centre)) == 1]
        return [centre, *near]

    def _differing(self, scheme: int, other: int) -> Sequence[str]:
        a, b = self.schemes[scheme], self.schemes[other]
        return [axis for axis in a if a[axis] != b[axis]]

    def _finished(self, scheme: int) -> Mapping[int, Point]:
        """Finished points of a scheme, by level."""
        return {
            level: point
            for (other, level), point in self.points.items()
            if other == scheme and point.finished
        }

    def _order(self, finished: Mapping[int, Point]) -> float:
        """Order of the error, from the two finest levels."""
        order = self._power({level: max(p.error, _TINY) for level, p in finished.items()})
        if order is None or order <= 0.0:  # an error that rises has crossed the reference
            return _ORDER
        return min(max(order, _ORDERS[0]), _ORDERS[1])

    def _growth(self, scheme: int, fixed: float) -> float:
        """Order of the time beyond `fixed`: that of the scheme, or the median of the others."""
        growths = {}
        for other in range(len(self.schemes)):
            power = self._power({k: p.time - fixed for k, p in self._finished(other).items()})
            if power is not None:
                growths[other] = min(max(-power, _GROWTHS[0]), _GROWTHS[1])
        if scheme in growths:
            return growths[scheme]
        return median(growths.values()) if growths else _GROWTH

    def _power(self, values: Mapping[int, float]) -> float | None:
        """Exponent of the spacing between the two finest levels; None if there is only one."""
        if len(values) < 2:
            return None
        coarse, fine = sorted(values)[-2:]
        return log(values[coarse] / values[fine]) / log(self.spacing(coarse) / self.spacing(fine))

    def reliability(self, best: Place | None) -> str:
        """How far the result can be trusted, in words."""
        tried = f"{len(self.points)} configurations tried"
        if best is None:
            return f"{tried}: none meets the goal, and none finer promises to"
        scheme, level = best
        finished = self._finished(scheme)
        error = finished[level].error
        if any(p.error > error for other, p in finished.items() if other < level):
            return f"{tried}: its error is smaller than at a coarser spacing, as it must be"
        if any(self.goal.met(p) for other, p in finished.items() if other > level):
            return f"{tried}: a finer spacing is good enough too"
        return f"{tried}: no finer spacing has been run, so its error may be small by chance"


def _extension(case: Case, name: str, levels: Sequence[Any]) -> Any:
    """A finer value than the last; None if there is none.

    Steps of whole numbers double, other numbers continue by their ratio.
    """
    if len(levels) < 2:
        return None
    before, last = levels[-2:]
    if isinstance(last, int) and isinstance(before, int):
        step = 2 * (last - before)
        guesses: list[Any] = [last + step + more for more in range(6)]
    elif isinstance(last, float) and isinstance(before, float):
        guesses = [last * last / before]
    else:
        return None
    finest = with_settings(case, {name: last}).resolution
    for guess in guesses:
        try:
            if with_settings(case, {name: guess}).resolution < finest:
                return guess
        except SceneError:
            continue
    return None
