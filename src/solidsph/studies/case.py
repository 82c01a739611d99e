"""Case: a scene with parameters, its reference solution and its error measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeAlias

import attrs

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.scene import Scene

Curves: TypeAlias = Mapping[str, Array]
"""Columns (k,) of a table by their headings, "quantity [unit]"; all of one length."""


class Picture(Protocol):
    """A picture that is drawn when it is saved."""

    def save(self, path: Path) -> Path:
        """Draw it into a file; returns the path."""


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
    paper: str = ""  # what the paper says of it, where it says something


@attrs.frozen
class Trial:
    """A case at hard settings. It is passed if everything that the case measures passes."""

    settings: Mapping[str, Any] = attrs.field(factory=dict)  # parameters of the case
    brief: Mapping[str, Any] = attrs.field(factory=dict)  # others, for a short form of it
    must_fail: str = ""  # of a negative control: why nothing may come through
    known: str = ""  # of a trial that the defaults do not pass: why, and what does


class Case(ABC):
    """One object behind reproduction, tests, cost, stability and the gallery.

    An implementation is a frozen attrs class whose fields are the case's parameters, set on the
    command line by `--set name=value`.
    """

    title: ClassVar[str]
    source: ClassVar[str]

    figures: ClassVar[tuple[str, ...]] = ()
    """Figures of the paper that it reproduces, such as "fig-11", and passages that it answers, such
    as "section-6-viscosity". The name of a picture begins with that of its figure or passage; one
    that shows several figures begins with all their numbers, "fig-13-14"."""

    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {}
    """Parameters to vary where accuracy is held against cost, each with the values to try. The
    first one refines: its values go from coarse to fine."""

    trials: ClassVar[Mapping[str, Trial]] = {}
    """Hard settings that `solidsph stability` puts it to, by name."""

    @abstractmethod
    def scenes(self) -> Mapping[str, Scene]:
        """The scenes to run, by name."""

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
        """What is run where accuracy is held against cost: itself, or what of it that takes."""
        return self

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The one of its measurements whose error is held against cost.

        Raises:
            SceneError: none of them has an error.
        """
        found = next((m for m in measurements if m.error is not None), None)
        if found is None:
            raise SceneError(
                f"{self.title!r} has no reference at these parameters; leave them as they are"
            )
        return found

    @property
    def resolution(self) -> float:
        """The smallest spacing of its particles [m], against which errors are held."""
        return min(
            body.spacing for scene in self.scenes().values() for body in scene.bodies.values()
        )

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        """The data of its pictures, to be written as tables, by name."""
        return {}
