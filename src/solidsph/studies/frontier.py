"""Frontier: the configurations of a case that are worth their time, and the price of a digit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from math import inf, isfinite, log, nan
from typing import Any, final

import attrs
import numpy as np

from solidsph.studies.limit import Limit
from solidsph.studies.point import Point, label, measured, percent
from solidsph.system import html

# Factor in time for a tenth of the error, beyond which it is no price but says that nothing helps.
_DEAR = 1e4

Cost = Callable[[Point], float]

AS_IT_IS = "as it is"
"""Label of a configuration without settings."""


@attrs.frozen
class Orders:
    """Orders of convergence of one scheme."""

    settings: Mapping[str, Any]  # all but the one that refines
    in_spacing: float  # p of error ~ spacing^p
    in_time: float  # p of error ~ time^-p
    crosses: bool  # whether an error rises on refinement, so that no power describes it

    @property
    def label(self) -> str:
        """Settings in one line."""
        return label(self.settings) or AS_IT_IS


@final
@attrs.frozen(slots=False, repr=False)
class Frontier:
    """Points of a sweep over one case. Iteration gives a row for each, for example for pandas."""

    points: Sequence[Point]
    refining: str  # the setting that refines
    limits: Sequence[Limit] = ()  # what errors are of where there is no reference
    unjudged: str = ""  # why no error could be estimated, though some have run

    @cached_property
    def _trusted(self) -> Mapping[int, float]:
        """Largest error of a point's scheme at its spacing or a finer one, by id of the point."""
        trusted = {}
        for points in self.schemes().values():
            largest = 0.0
            for point in reversed(points):
                largest = max(largest, point.error)
                trusted[id(point)] = largest
        return trusted

    def trusted(self, point: Point) -> float:
        """Error that refinement does not exceed [-]; a smaller one was small by chance."""
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
        """Points that no other beats in both cost and trusted error, by rising cost.

        Args:
            cost: by default the median wall time.
        """
        chosen: list[Point] = []
        for point in sorted(self.finished(), key=lambda point: (cost(point), self.trusted(point))):
            if not chosen or self.trusted(point) < self.trusted(chosen[-1]):
                chosen.append(point)
        return chosen

    def finished(self) -> Sequence[Point]:
        """Points with a finite error."""
        return [point for point in self.points if point.finished]

    def schemes(self) -> Mapping[str, Sequence[Point]]:
        """Finished points of each scheme, from coarse to fine."""
        groups: dict[str, list[Point]] = {}
        for point in self.finished():
            groups.setdefault(self.scheme(point), []).append(point)
        return {
            name: sorted(points, key=lambda point: -point.spacing)
            for name, points in groups.items()
        }

    def scheme(self, point: Point) -> str:
        """Scheme of a point: all its settings but the refining one, in one line."""
        return label(self._scheme(point)) or AS_IT_IS

    def _scheme(self, point: Point) -> Mapping[str, Any]:
        return {k: v for k, v in point.settings.items() if k != self.refining}

    def orders(self) -> Sequence[Orders]:
        """Fitted orders of every scheme with two points or more."""
        return [self._orders(points) for points in self.schemes().values() if len(points) > 1]

    def _orders(self, points: Sequence[Point]) -> Orders:
        errors = [point.error for point in points]
        return Orders(
            self._scheme(points[0]),
            in_spacing=fitted_exponent([point.spacing for point in points], errors),
            in_time=-fitted_exponent([point.time for point in points], errors),
            crosses=any(fine > coarse for coarse, fine in pairwise(errors)),
        )

    def next_digit(self) -> float:
        """Factor in time for a tenth of the error, along the front."""
        front = self.front()
        falls = -fitted_exponent(
            [point.time for point in front], [self.trusted(point) for point in front]
        )
        return 10.0 ** (1.0 / falls) if falls > 0.0 else inf

    def cheapest(self, accuracy: float) -> Point | None:
        """The quickest point with at most this trusted error."""
        within = [point for point in self.front() if self.trusted(point) <= accuracy]
        return within[0] if within else None

    def best(self, time: float) -> Point | None:
        """The point with the smallest trusted error that takes at most this time [s]."""
        within = [point for point in self.front() if point.time <= time]
        return within[-1] if within else None

    def numbers(self, points: Sequence[Point]) -> Sequence[int]:
        """Places of these points in the sweep, from 0."""
        places = {id(point): number for number, point in enumerate(self.points)}
        return [places[id(point)] for point in points]

    def excess(self, point: Point) -> float:
        """Time of a point over that of the quickest with its trusted error [-].

        1 on the front; infinite if it did not finish.
        """
        if not point.finished:
            return inf
        cheaper = self.cheapest(self.trusted(point))
        return 1.0 if cheaper is None else max(1.0, point.time / cheaper.time)

    @property
    def quantity(self) -> str:
        """Quantity that the errors are of; empty if no point knows it."""
        return next((point.quantity for point in self.points if point.quantity), "")

    def second_order(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Spacings [m] and errors [-] of a line of second order below all errors, for pictures.

        None unless two spacings have finished with an error.
        """
        spacings = [p.spacing for p in self.finished() if isfinite(p.spacing)]
        errors = [p.error for p in self.finished() if p.error > 0.0]
        if not errors or not spacings or not 0.0 < min(spacings) < max(spacings):
            return None
        coarse, fine, least = max(spacings), min(spacings), 0.7 * min(errors)
        return (coarse, fine), (least * (coarse / fine) ** 2, least)

    def __repr__(self) -> str:
        return f"Frontier({len(self)} configurations: {self.sentence()})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        front = [
            {
                "configuration": point.label() or AS_IT_IS,
                "error [%]": 100.0 * point.error,
                "trusted [%]": 100.0 * self.trusted(point),
                "time [s]": point.time,
            }
            for point in self.front()
        ]
        title = f"The front, of {len(self)} configurations"
        rows = front or measured(self.points)
        return html.heading(title, self.sentence()) + html.of_rows(rows)

    def sentence(self) -> str:
        """Summary in words."""
        front = self.front()
        if not front:
            if self.unjudged:
                return self.unjudged
            failed = self.points[0].outcome if self.points else "there is no point"
            return f"no configuration finished: {failed}"
        parts = []
        worst = max(self.limits, key=lambda limit: limit.bar, default=None)
        if worst is not None and worst.warning:
            parts.append(f"errors are estimates to be used with care: {worst.warning}")
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
            f"the smallest error was {percent(self.trusted(last))}, in {_time(last.time)} "
            f"with {last.label()}"
        )
        price = self.next_digit()
        if len(front) > 1 and price <= _DEAR:
            parts.append(f"along the front each further digit takes {price:.2g} times the time")
        elif len(front) > 1:
            parts.append("along the front more time hardly makes the error smaller")
        return "; ".join(parts) + "."


def fitted_exponent(costs: Sequence[float], errors: Sequence[float]) -> float:
    """Exponent p of errors ~ costs^p by least squares of logarithms; nan if there is none."""
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
