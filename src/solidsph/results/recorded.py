"""Recorded: what pictures, views and tables need of a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.error_bars import ErrorBar
from solidsph.results.time_series import TimeSeries

DISPLACEMENT = "displacement"
"""Field of every record, though none holds it."""


class Recorded(Protocol):
    """A run that can be shown, such as a `Record`."""

    @property
    def path(self) -> Path:
        """Its file."""

    @property
    def outcome(self) -> str:
        """How it ended."""

    @property
    def notes(self) -> Sequence[str]:
        """What happened to it."""

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of the software that produced it, by its name."""

    @property
    def field_names(self) -> Sequence[str]:
        """The fields that each output holds."""

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
