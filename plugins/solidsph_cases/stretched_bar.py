"""The paper's bar in tension, perturbed, in one Lagrangian form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import finished
from solidsph_cases._stability_map import TOTAL, UPDATED
from solidsph_cases.tensile_instability import STUDIES, TensileInstability, spread


@final
@attrs.frozen
class StretchedBar(Case):
    """What of `tensile-instability` is a question of stable or not: one form at one stretch."""

    title = "A stretched bar, its middle particle out of place"
    source = "Ismail & Reddy, section 5.2: a disturbance spreads"
    studies = STUDIES
    sweep = {"spacing": (5e-3, 2.5e-3), "cover": (3.5, 5.5)}
    trials = {
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
        return {"bar": case.perturbed(self.form)}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bar"]
        ratio = spread(record, self.stretch)
        return [
            Measurement(
                "largest deviation at the end over that at the start",
                ratio,
                "1",
                source=self.source,
                verdict="spread" if ratio <= 1.0 else "grew",
                passed=finished(record) and ratio <= 1.0,
            )
        ]

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        (found,) = measurements
        return attrs.evolve(found, error=found.value)
