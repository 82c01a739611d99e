"""OneSceneCase: a case of one scene, by what columns of its history should be."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph.studies.quantity import one_quantity
from solidsph.studies.reference import Reference

_NAME = "scene"


class OneSceneCase(Case):
    """A case that is told by its scene and by what some columns of its history should be.

    An implementation is a frozen attrs class; its fields are the parameters of the case.
    """

    tolerance: ClassVar[float] = 0.01
    """Largest error with which a run passes [-]."""

    @abstractmethod
    def scene(self) -> Scene:
        """The scene to run."""

    @abstractmethod
    def expected(self) -> Mapping[str, float | str]:
        """Number, formula of the time t, or name of a file with a curve, by column.

        A column may be named without its unit, and after `final`, `peak` or `mean`.
        """

    def scenes(self) -> Mapping[str, Scene]:
        return {_NAME: self.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record, scene = records[_NAME], self.scene()
        columns = list(record.history)
        return [
            Reference.of(
                one_quantity(scene, columns, name),
                value,
                source=self.source,
                tolerance=self.tolerance,
            ).measurement(record)
            for name, value in self.expected().items()
        ]
