"""The cheapest configuration for an accuracy, and the nearest for a time, by few runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from math import inf, isfinite, log
from statistics import median
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.studies.case import Case
from solidsph.studies.point import Point
from solidsph.studies.variant import with_settings

Settings = Mapping[str, Any]
Axes = Mapping[str, Sequence[Any]]

# Before two levels of a scheme are known: errors of a high order, so that no scheme is given up too
# soon, and times of an explicit run in two dimensions. What is known replaces them.
_ORDER, _GROWTH = 2.5, 3.0
_ORDERS, _GROWTHS = (0.5, 4.0), (0.5, 5.0)

# What of the shortest run is there whatever the spacing: building, starting, compiling.
_FIXED = 0.5

_TINY = 1e-300

# A candidate must promise to be so much better than what is found to be worth a run, and may
# promise to miss the goal by so much.
_GAIN = 1.25
_MISS = 1.2

# How often the refining axis may be prolonged beyond the values that were given.
_PROLONGED = 6


class Goal(ABC):
    """What is looked for."""

    @abstractmethod
    def met(self, point: Point) -> bool:
        """Whether a point is good enough."""

    @abstractmethod
    def loss(self, error: float, time: float) -> float:
        """What is to be small among those that are."""

    @abstractmethod
    def promising(self, error: float, time: float) -> bool:
        """Whether a point of that predicted error and time would be good enough."""

    @abstractmethod
    def refuted(self, finer: Point) -> bool:
        """Whether a finer point of its scheme shows that a point was good enough by chance."""

    @abstractmethod
    def exhausted(self, error: float, time: float) -> bool:
        """Whether nothing finer than a point of that error and time can be."""


@final
@attrs.frozen
class Accuracy(Goal):
    """At most an error; then the less time the better."""

    error: float  # relative [-]

    def met(self, point: Point) -> bool:
        return point.finished and point.error <= self.error

    def loss(self, error: float, time: float) -> float:
        return time

    def promising(self, error: float, time: float) -> bool:
        return error <= _MISS * self.error

    def refuted(self, finer: Point) -> bool:
        return finer.error > self.error

    def exhausted(self, error: float, time: float) -> bool:
        return error <= self.error


@final
@attrs.frozen
class TimeLimit(Goal):
    """At most a wall time; then the smaller the error the better."""

    time: float  # [s]

    def met(self, point: Point) -> bool:
        return point.finished and point.time <= self.time

    def loss(self, error: float, time: float) -> float:
        return error

    def promising(self, error: float, time: float) -> bool:
        return time <= _MISS * self.time

    def refuted(self, finer: Point) -> bool:
        return False  # whatever it is, it is the smallest that was found

    def exhausted(self, error: float, time: float) -> bool:
        return time > self.time


@attrs.frozen
class SearchResult:
    """What a search came to."""

    point: Point | None  # the best that meets the goal; None if none does
    tried: Sequence[Point]
    sure: str  # how sure it is, in words

    @property
    def spent(self) -> float:
        """Wall time of all runs [s]."""
        return sum(sum(one.seconds) for one in self.tried if isfinite(one.time))


def search(
    case: Case,
    axes: Axes,
    goal: Goal,
    run: Callable[[Settings], Point],
    *,
    longest: float = 600.0,
) -> SearchResult:
    """Look for `goal` among the values of `axes`, and beyond the finest if need be.

    A scheme is a choice of all but the refining axis. The one in the middle, and those that differ
    from it in one choice, run at their coarsest: what each choice does to error and time is taken
    to do the same in any company. From there powers of the spacing predict the rest; the most
    promising is run, and what it shows replaces the prediction, until nothing promises to be worth
    a run. What is good enough without being better than anything coarser is run once more, finer,
    lest it be so by chance.

    Args:
        case: already `priced`.
        axes: values by setting; the first refines, from coarse to fine.
        run: what measures a configuration.
        longest: predicted wall time beyond which nothing is run [s].
    """
    book = _Book(case, *_split(axes))
    while True:
        wanted = book.next(goal, longest)
        if wanted is None:
            break
        book.note(wanted, run(book.settings(wanted)))
    best = book.best(goal)
    return SearchResult(best, list(book.points.values()), book.sure(goal, best))


@attrs.define(eq=False)
class _Book:
    """What is known of every scheme at every level."""

    case: Case
    refining: str
    levels: list[Any]
    schemes: Sequence[Settings]
    points: dict[tuple[int, int], Point] = attrs.field(factory=dict)  # by scheme and level
    _spacings: dict[Any, float] = attrs.field(factory=dict)
    _given: int = 0

    def __attrs_post_init__(self) -> None:
        self._given = len(self.levels)

    def settings(self, place: tuple[int, int]) -> Settings:
        scheme, level = place
        return {self.refining: self.levels[level], **self.schemes[scheme]}

    def note(self, place: tuple[int, int], point: Point) -> None:
        self.points[place] = point

    def best(self, goal: Goal) -> Point | None:
        place = self._best(goal)
        return None if place is None else self.points[place]

    def _best(self, goal: Goal) -> tuple[int, int] | None:
        met = [
            (scheme, level)
            for (scheme, level), point in self.points.items()
            if goal.met(point)
            and not any(
                goal.refuted(finer) for place, finer in self._known(scheme).items() if place > level
            )
        ]

        def loss(place: tuple[int, int]) -> float:
            return goal.loss(self.points[place].error, self.points[place].time)

        return min(met, key=loss, default=None)

    def _doubtful(self, goal: Goal, longest: float) -> tuple[int, int] | None:
        """Where to look whether the best is good enough by chance; None if that is known."""
        best = self._best(goal)
        if best is None:
            return None
        scheme, level = best
        known = self._known(scheme)
        finer = [place for place in known if place > level]
        coarser = [point for place, point in known.items() if place < level]
        if finer or any(point.error > known[level].error for point in coarser):
            return None
        place = (scheme, level + 1)
        if self._has(level + 1) and self.predicted(*place)[1] <= longest:
            return place
        return None

    def next(self, goal: Goal, longest: float) -> tuple[int, int] | None:
        """The place to run next, None if there is nothing left to gain."""
        for scheme in self._star():
            if (scheme, 0) not in self.points:
                return scheme, 0
        best = self.best(goal)
        bound = goal.loss(best.error, best.time) / _GAIN if best else inf
        offers = sorted(self._offers(goal, longest))
        if offers and offers[0][0] < bound:
            return offers[0][1]
        return self._doubtful(goal, longest)

    def _offers(self, goal: Goal, longest: float) -> Iterator[tuple[float, tuple[int, int]]]:
        """Of each scheme the place that promises most, with its predicted loss."""
        for scheme in range(len(self.schemes)):
            offers = []
            level = 0
            while self._has(level):
                error, time = self.predicted(scheme, level)
                if time > longest:
                    break
                if (scheme, level) not in self.points and goal.promising(error, time):
                    offers.append((goal.loss(error, time), (scheme, level)))
                if goal.exhausted(error, time) and (scheme, level) not in self.points:
                    break
                level += 1
            if offers:
                yield min(offers)

    def _has(self, level: int) -> bool:
        """Whether there is such a level, prolonging the axis if it can be."""
        if level >= len(self.levels) and len(self.levels) < self._given + _PROLONGED:
            longer = _prolonged(self.case, self.refining, self.levels)
            if longer is not None:
                self.levels.append(longer)
        return level < len(self.levels)

    def spacing(self, level: int) -> float:
        value = self.levels[level]
        if value not in self._spacings:
            self._spacings[value] = with_settings(self.case, {self.refining: value}).resolution
        return self._spacings[value]

    def predicted(self, scheme: int, level: int) -> tuple[float, float]:
        """Error and time of a scheme at a level: measured, or by the powers of what is."""
        if (scheme, level) in self.points:
            here = self.points[scheme, level]
            return here.error, here.time
        known = self._known(scheme)
        if any(one == scheme for one, _ in self.points) and not known:
            return inf, inf  # it failed
        nearest = min(known, key=lambda place: abs(place - level), default=0)
        point = known.get(nearest)
        error, time = (point.error, point.time) if point else self._by_choices(scheme)
        ratio = self.spacing(level) / self.spacing(nearest)
        fixed = self._fixed()
        growth = self._growth(scheme, fixed)
        return error * ratio ** self._order(known), fixed + (time - fixed) * ratio**-growth

    def _by_choices(self, scheme: int) -> tuple[float, float]:
        """Error and time of a scheme at its coarsest, from those that make one of its choices."""
        centre, *star = self._star()
        base = self.points[centre, 0]
        error, time = base.error, base.time
        for one in star:
            (axis,) = self._differing(one, centre)
            if self.schemes[scheme][axis] == self.schemes[one][axis]:
                point = self.points[one, 0]
                error *= max(point.error, _TINY) / max(base.error, _TINY)
                time *= point.time / base.time
        return error, time

    def _star(self) -> Sequence[int]:
        """The scheme of the case's own parameters, where the axes have them, and its neighbours."""
        own = {
            axis: value
            for axis in self.schemes[0]
            for value in [getattr(self.case, axis, None)]
            if any(scheme[axis] == value for scheme in self.schemes)
        }
        middle = {**self.schemes[0], **own}
        centre = next(i for i, scheme in enumerate(self.schemes) if scheme == middle)
        near = [i for i in range(len(self.schemes)) if len(self._differing(i, centre)) == 1]
        return [centre, *near]

    def _differing(self, one: int, other: int) -> Sequence[str]:
        a, b = self.schemes[one], self.schemes[other]
        return [axis for axis in a if a[axis] != b[axis]]

    def _known(self, scheme: int) -> Mapping[int, Point]:
        return {
            level: point
            for (one, level), point in self.points.items()
            if one == scheme and point.finished
        }

    def _order(self, known: Mapping[int, Point]) -> float:
        """Of the error, by the two finest levels known."""
        errors = {level: max(point.error, _TINY) for level, point in known.items()}
        found = self._power(errors)
        if found is None or found <= 0.0:  # what rises has crossed the reference: all is open
            return _ORDER
        return min(max(found, _ORDERS[0]), _ORDERS[1])

    def _fixed(self) -> float:
        """What every run takes whatever its spacing, about [s]."""
        times = [point.time for point in self.points.values() if point.finished]
        return _FIXED * min(times, default=0.0)

    def _growth(self, scheme: int, fixed: float) -> float:
        """Of the time beyond what is fixed: the scheme's own, or the middle one of the others."""
        found = {}
        for one in range(len(self.schemes)):
            rest = {level: point.time - fixed for level, point in self._known(one).items()}
            power = self._power(rest)
            if power is not None:
                found[one] = min(max(-power, _GROWTHS[0]), _GROWTHS[1])
        if scheme in found:
            return found[scheme]
        return median(found.values()) if found else _GROWTH

    def _power(self, values: Mapping[int, float]) -> float | None:
        """Exponent of the spacing by which values went between the two finest levels."""
        if len(values) < 2:
            return None
        coarse, fine = sorted(values)[-2:]
        return log(values[coarse] / values[fine]) / log(self.spacing(coarse) / self.spacing(fine))

    def sure(self, goal: Goal, best: Point | None) -> str:
        """In words, how far the result can be trusted."""
        tried = f"{len(self.points)} configurations tried"
        if best is None:
            return f"{tried}: none meets the goal, and none finer promises to"
        scheme, level = next(place for place, point in self.points.items() if point is best)
        known = self._known(scheme)
        if any(point.error > best.error for place, point in known.items() if place < level):
            return f"{tried}: its error is smaller than at a coarser spacing, as it must be"
        if any(goal.met(point) for place, point in known.items() if place > level):
            return f"{tried}: a finer spacing is good enough too"
        return f"{tried}: its error at no finer spacing is known, so that it may be small by chance"


def _split(axes: Axes) -> tuple[str, list[Any], Sequence[Settings]]:
    if not axes:
        raise SceneError("nothing to search: no axis; give --axis name=values")
    refining, *others = axes
    schemes = [
        dict(zip(others, values, strict=True)) for values in product(*(axes[o] for o in others))
    ]
    return refining, list(axes[refining]), schemes


def _prolonged(case: Case, name: str, levels: Sequence[Any]) -> Any:
    """A finer value than the last: steps of whole numbers double, numbers go on by their ratio."""
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
