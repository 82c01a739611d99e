"""Frontier: which configurations of a case are worth their time, and what the next digit costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from math import inf, isfinite, log, nan
from typing import Any, final

import attrs
import numpy as np

from solidsph.studies.point import Point

Cost = Callable[[Point], float]


@attrs.frozen
class Orders:
    """Powers by which the error of one scheme falls as it is refined."""

    settings: Mapping[str, Any]  # all but the one that refines
    in_spacing: float  # error ~ spacing^p
    in_time: float  # error ~ time^-p
    crosses: bool  # an error is larger than at a coarser spacing: no power describes it


@final
@attrs.frozen(slots=False)
class Frontier:
    """The points of a sweep over one case. Iterating gives a row for each, as pandas takes them."""

    points: Sequence[Point]
    refining: str  # the setting that refines

    @cached_property
    def _trusted(self) -> Mapping[int, float]:
        """Of every point, by its identity: the largest error of its scheme at its spacing or any
        finer one."""
        trusted = {}
        for points in self.schemes().values():
            largest = 0.0
            for point in reversed(points):
                largest = max(largest, point.error)
                trusted[id(point)] = largest
        return trusted

    def trusted(self, point: Point) -> float:
        """An error that refinement does not take back [-]: a smaller one was small by chance."""
        return self._trusted.get(id(point), point.error)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        front = self.front()
        for point in self.points:
            yield {
                **point.settings,
                "error": point.error,
                "trusted error": self.trusted(point),
                "time [s]": point.time,
                "shortest [s]": min(point.seconds),
                "longest [s]": max(point.seconds),
                "spacing [m]": point.spacing,
                "particles": point.particles,
                "steps": point.steps,
                "pair evaluations": point.pair_evaluations,
                "bytes touched": point.bytes_touched,
                "peak memory [bytes]": point.peak_memory,
                "on the front": point in front,
                "outcome": point.outcome,
            }

    def __len__(self) -> int:
        return len(self.points)

    def front(self, cost: Cost = lambda point: point.time) -> Sequence[Point]:
        """Points than which none is both cheaper and nearer, by rising cost.

        How near a point is says the error that can be trusted: what crosses the reference on its
        way past it is not nearer for that.

        Args:
            cost: what is cheap: by default the median wall time.
        """
        chosen: list[Point] = []
        for point in sorted(self.finished(), key=lambda point: (cost(point), self.trusted(point))):
            if not chosen or self.trusted(point) < self.trusted(chosen[-1]):
                chosen.append(point)
        return chosen

    def finished(self) -> Sequence[Point]:
        """Points that have an error."""
        return [point for point in self.points if point.finished]

    def schemes(self) -> Mapping[str, Sequence[Point]]:
        """Finished points that differ in the refining setting only, from coarse to fine."""
        groups: dict[str, list[Point]] = {}
        for point in self.finished():
            groups.setdefault(self.scheme(point), []).append(point)
        return {
            name: sorted(points, key=lambda point: -point.spacing)
            for name, points in groups.items()
        }

    def scheme(self, point: Point) -> str:
        """All settings of a point but the refining one, in a line."""
        rest = {k: v for k, v in point.settings.items() if k != self.refining}
        return attrs.evolve(point, settings=rest).label() or "as it is"

    def orders(self) -> Sequence[Orders]:
        """Fitted orders of every scheme of which there are two points or more."""
        return [self._orders(points) for points in self.schemes().values() if len(points) > 1]

    def _orders(self, points: Sequence[Point]) -> Orders:
        settings = {k: v for k, v in points[0].settings.items() if k != self.refining}
        errors = [point.error for point in points]
        return Orders(
            settings,
            in_spacing=fitted_exponent([point.spacing for point in points], errors),
            in_time=-fitted_exponent([point.time for point in points], errors),
            crosses=any(fine > coarse for coarse, fine in pairwise(errors)),
        )

    def next_digit(self) -> float:
        """How many times the time a tenth of the error takes, along the front."""
        front = self.front()
        falls = -fitted_exponent(
            [point.time for point in front], [self.trusted(point) for point in front]
        )
        return 10.0 ** (1.0 / falls) if falls > 0.0 else inf

    def cheapest(self, accuracy: float) -> Point | None:
        """The quickest point with at most that error, to be trusted."""
        within = [point for point in self.front() if self.trusted(point) <= accuracy]
        return within[0] if within else None

    def best(self, time: float) -> Point | None:
        """The point with the smallest error that takes at most that time [s]."""
        within = [point for point in self.front() if point.time <= time]
        return within[-1] if within else None

    def excess(self, point: Point) -> float:
        """How much longer a point takes than its error must, by the front between its points [-].

        1 on the front; infinite if it did not finish.
        """
        if not point.finished:
            return inf
        cheaper = self.cheapest(self.trusted(point))
        return 1.0 if cheaper is None else max(1.0, point.time / cheaper.time)

    def sentence(self) -> str:
        """What a person can act on."""
        front = self.front()
        if not front:
            failed = self.points[0].outcome if self.points else "there is no point"
            return f"no configuration finished: {failed}"
        parts = []
        for accuracy in (0.1, 0.01, 0.001):
            point = self.cheapest(accuracy)
            if point is not None:
                parts.append(
                    f"{100.0 * accuracy:g} % takes {_time(point.time)} with {point.label()}"
                )
        last = front[-1]
        if not parts:
            parts.append(f"10 % was not reached by any of {len(self.points)} configurations")
        parts.append(
            f"nothing was nearer than {100.0 * self.trusted(last):.2g} %, in {_time(last.time)} "
            f"with {last.label()}"
        )
        price = self.next_digit()
        if isfinite(price) and len(front) > 1:
            parts.append(f"along the front each further digit takes {price:.2g} times the time")
        return "; ".join(parts) + "."


def fitted_exponent(costs: Sequence[float], errors: Sequence[float]) -> float:
    """The exponent p of errors ~ costs^p by least squares of logarithms; nan if there is none."""
    pairs = [
        (log(cost), log(error))
        for cost, error in zip(costs, errors, strict=True)
        if 0.0 < cost < inf and 0.0 < error < inf
    ]
    if len(pairs) < 2 or len({x for x, _ in pairs}) < 2:
        return nan
    x, y = np.array(pairs).T
    return float(np.polyfit(x, y, 1)[0])


def _time(seconds: float) -> str:
    if seconds < 0.995:
        return f"{1e3 * seconds:.0f} ms"
    return f"{seconds:.2g} s" if seconds < 99.5 else f"{seconds / 60.0:.2g} min"
