"""The paper's bar in tension, perturbed, in one Lagrangian form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import FINISHED
from solidsph_cases.tensile_instability import TensileInstability, deviation

TOTAL, UPDATED = "total-lagrangian", "updated-lagrangian"


@final
@attrs.frozen
class StretchedBar(Case):
    """What of `tensile-instability` is a question of stable or not: one form at one stretch."""

    title: ClassVar[str] = "A stretched bar, its middle particle out of place"
    source: ClassVar[str] = "Ismail & Reddy, section 5.2: a disturbance spreads"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "spacing": (5e-3, 2.5e-3),
        "cover": (3.5, 5.5),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "total Lagrangian": Trial(),
        "updated Lagrangian": Trial(
            {"form": UPDATED}, must_fail="neighbours of the current configuration clump in tension"
        ),
    }

    form: str = TOTAL
    stretch: float = number(default=1.2)  # [-]
    spacing: float = number(default=2.5e-3)  # [m]
    cover: float = number(default=5.5)  # [spacings]

    def scenes(self) -> Mapping[str, Scene]:
        case = TensileInstability(stretch=self.stretch, spacing=self.spacing, cover=self.cover)
        return {"bar": case.scene(self.form, case.transits * case.transit)}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bar"]
        deviations = np.abs(deviation(record, self.stretch)).max(axis=1)
        ratio = float(deviations[-1] / deviations[0])
        return [
            Measurement(
                quantity="largest deviation at the end over that at the start",
                value=ratio,
                unit="1",
                source=self.source,
                verdict="spread" if ratio <= 1.0 else "grew",
                passed=record.outcome == FINISHED and ratio <= 1.0,
            )
        ]

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        (found,) = measurements
        return attrs.evolve(found, error=found.value)

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
