"""Cases: scenes with parameters, a reference solution and an error measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeAlias

import attrs

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.graded_spacing import least_spacing
from solidsph.scene.scene import Scene

Curves: TypeAlias = Mapping[str, Array]
"""Columns of a table, each (k,), by headings "quantity [unit]"."""


class Picture(Protocol):
    """A picture that is drawn when it is saved."""

    def save(self, path: Path) -> Path:
        """Draw it into a file; returns the path."""


@attrs.frozen
class Measurement:
    """A measured value and its reference."""

    quantity: str
    value: float
    unit: str
    reference: float | None = None  # None if there is none
    source: str = ""  # of the reference
    error: float | None = None  # relative, unless the case defines it otherwise
    verdict: str = ""  # its meaning in a word or two
    passed: bool = True  # whether the outcome is as the source predicts
    paper: str = ""  # statement of the paper about it, if any
    scale: float | None = None  # what an error is relative to where there is no reference


@attrs.frozen
class Trial:
    """Hard settings of a case. The trial passes if all measurements of the case pass."""

    settings: Mapping[str, Any] = attrs.field(factory=dict)  # parameters of the case
    brief: Mapping[str, Any] = attrs.field(factory=dict)  # further ones for its short form
    must_fail: str = ""  # for a negative control: the reason why it must fail
    known: str = ""  # for a trial that the defaults fail: the reason, and what passes


class Case(ABC):
    """A case, as used by reproduction, tests, cost, stability and the gallery.

    An implementation is a frozen attrs class. Its fields are the parameters of the case, which
    `--set name=value` sets on the command line.
    """

    title: ClassVar[str]
    source: ClassVar[str]

    figures: ClassVar[tuple[str, ...]] = ()
    """Figures of the paper that it reproduces, such as "fig-11", and passages that it answers, such
    as "section-6-viscosity". The name of a picture begins with that of its figure or passage, or
    with the numbers of all its figures, "fig-13-14"."""

    studies: ClassVar[Mapping[str, str]] = {}
    """Words of the scheme that its scenes name, each with the reason: what the case is about, or
    what the recommended scheme lacks there. All else is the scheme's (see `scene_words.named`)."""

    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {}
    """Parameters to vary in a cost sweep, each with the values to try. The first one refines, from
    coarse to fine."""

    trials: ClassVar[Mapping[str, Trial]] = {}
    """Trials of `solidsph stability`, by name."""

    @abstractmethod
    def scenes(self) -> Mapping[str, Scene]:
        """Scenes to run, by name."""

    @abstractmethod
    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        """Compare the records of those scenes with the reference."""

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Picture]:
        """The pictures of those records by file name, without its ending."""
        return {}

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        """Write the case's pictures into `folder`; returns their paths."""
        return [
            picture.save(folder / f"{name}.png") for name, picture in self.pictures(records).items()
        ]

    def priced(self) -> Case:
        """Case to run in a cost sweep: itself, or the part of it that matters there."""
        return self

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The measurement whose error is compared with the cost; by default the first with one.

        Raises:
            SceneError: none of them has an error.
        """
        for measurement in measurements:
            if measurement.error is not None:
                return measurement
        raise SceneError(
            f"{self.title!r} has no reference at these parameters; leave them as they are"
        )

    @property
    def resolution(self) -> float:
        """Smallest particle spacing [m], the measure of its refinement."""
        return min(
            least_spacing(body)
            for scene in self.scenes().values()
            for body in scene.bodies.values()
        )

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        """Data of the pictures, to be written as tables, by name."""
        return {}
