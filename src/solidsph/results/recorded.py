"""Recorded: what pictures and views need of a record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.error_bars import ErrorBar
from solidsph.results.time_series import TimeSeries


class Recorded(Protocol):
    """A run that can be drawn, such as a `Record`."""

    @property
    def scene(self) -> str:
        """The scene as TOML text."""

    @property
    def dimension(self) -> int:
        """Number of space dimensions."""

    @property
    def particles(self) -> Particles:
        """Reference data of all particles."""

    @property
    def times(self) -> Array:
        """(steps,) t [s]."""

    @property
    def positions(self) -> TimeSeries:
        """(steps, n, d) current positions [m]."""

    @property
    def history(self) -> Mapping[str, Array]:
        """Column -> (steps,) values."""

    @property
    def history_units(self) -> Mapping[str, str]:
        """Unit of each column."""

    @property
    def error_bars(self) -> Mapping[str, ErrorBar]:
        """Numbers with their estimated errors, by quantity."""

    @property
    def count(self) -> int:
        """Number of outputs."""

    def field(self, name: str) -> TimeSeries:
        """The named field over time."""
