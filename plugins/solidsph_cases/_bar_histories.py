"""Stress over time at stations of a bar, beside d'Alembert's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph_cases._bar import LENGTH, along, first_rise, stress_along
from solidsph_cases._bar_waves import BarWaves
from solidsph_cases._compare import compared

SOURCE = "d'Alembert with reflections"


@final
@attrs.frozen(eq=False)
class Histories:
    """Stress over time at any station, computed and exact."""

    record: Record
    times: Array  # (t,) [s]
    X: Array  # (n,) [m]
    stress: Array  # (t, n) [Pa]
    exact: BarWaves

    @classmethod
    def of(cls, record: Record, exact: BarWaves) -> Histories:
        return cls(record, record.times, along(record), stress_along(record), exact)

    def at(self, station: float) -> Array:
        """Stress of the particle at a station [Pa]."""
        return np.asarray(self.stress[:, int(np.argmin(np.abs(self.X - station)))])

    def height(self, station: float) -> float:
        """Exact stress of the first passage: at the wall both waves add [Pa]."""
        doubled = 2.0 if station == LENGTH else 1.0
        return doubled * self.exact.stress_height

    def _passage(self, begin: float) -> Mask:
        """Times while the pulse passes that arrives at `begin` [s], (t,)."""
        end = begin + self.exact.pulse.duration
        return np.asarray((self.times >= begin) & (self.times <= end))

    def peak(self, station: float) -> tuple[float, float]:
        """Peak of the first passage and what it should be [Pa]."""
        shown = self._passage(station / self.exact.speed)
        return float(self.at(station)[shown].min(initial=0.0)), self.height(station)

    def peak_of_passage(self, station: float, passage: int) -> tuple[float, float]:
        """Largest stress of the passage number 0, 1, 2 ... to the right and to the left in turn,
        with its sign, and what it should be [Pa]."""
        turns, leftward = divmod(passage, 2)
        way = 2.0 * LENGTH * (turns + leftward) + (-station if leftward else station)
        shown = self._passage(way / self.exact.speed)
        height = self.exact.left**turns * self.exact.stress_height
        seen = self.at(station)[shown] * np.sign(height)
        return float(seen.max(initial=0.0) * np.sign(height)), height

    def arrival(self, station: float) -> tuple[float, float]:
        """When half the height first comes, and when it should [s]."""
        scaled = self.at(station) / self.height(station)
        due = station / self.exact.speed + self.exact.pulse.half_height
        return first_rise(self.times, scaled, 0.5), due

    def plateau(self, station: float) -> tuple[float, float]:
        """Mean stress of the first passage, and what it should be [Pa].

        With the weights of a Hann window over the middle of the passage: without viscosity the
        stress rings about its mean, and what is left of an oscillation in a plain mean depends on
        where its ends happen to fall.
        """
        since = (self.times - station / self.exact.speed) / self.exact.pulse.duration
        weights = np.sin(np.pi * np.clip((since - 0.1) / 0.8, 0.0, 1.0)) ** 2
        return float(weights @ self.at(station) / weights.sum()), self.height(station)

    def overshoot(self, station: float) -> float:
        """By how much the first passage exceeds its height, over it."""
        shown = self._passage(station / self.exact.speed)
        return float((self.at(station)[shown] / self.height(station)).max() - 1.0)

    def worst(
        self,
        quantity: str,
        unit: str,
        tolerance: float,
        read: Read,
        stations: Sequence[float],
    ) -> Measurement:
        """What is read at that of the stations where it is farthest off."""
        found = {station: read(self, station) for station in stations}

        def error(station: float) -> float:
            value, reference = found[station]
            off = abs(value / reference - 1.0)
            return off if np.isfinite(off) else np.inf

        station = max(stations, key=error)
        if len(stations) > 1:
            quantity += f", worst at {station:g} m"
        value, reference = found[station]
        return compared(self.record, quantity, value, unit, reference, SOURCE, tolerance)


Read: TypeAlias = Callable[[Histories, float], tuple[float, float]]
"""A number of the history at a station, and what it should be."""
