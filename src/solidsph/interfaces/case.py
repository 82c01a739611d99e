"""Case: a scene with parameters, its reference solution and its error measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import attrs

from solidsph.results.record import Record
from solidsph.scene import Scene


@attrs.frozen
class Measurement:
    """A number beside the number it should be."""

    quantity: str
    value: float
    unit: str
    reference: float | None = None  # None where the measurement stands alone
    source: str = ""  # where the reference comes from
    error: float | None = None  # as the case measures it, relative unless it says otherwise
    verdict: str = ""  # what it means, in a word or two
    passed: bool = True  # whether the outcome is the one that the source predicts


class Case(ABC):
    """One object behind reproduction, tests, cost, stability and the gallery.

    An implementation is a frozen attrs class whose fields are the case's parameters, set on the
    command line by `--set name=value`.
    """

    title: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def scenes(self) -> Mapping[str, Scene]:
        """The scenes to run, by name."""

    @abstractmethod
    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        """Compare the records of those scenes with the reference."""

    @abstractmethod
    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        """Write the case's pictures into `folder`; returns their paths."""
