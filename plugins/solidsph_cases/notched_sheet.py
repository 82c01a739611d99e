"""A notched sheet of rubber pulled to four times its height."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import alone, vanishing
from solidsph_cases._energy import smallest_volume_ratio

SIDE, DEPTH, MOUTH = 1.0, 0.3, 0.15  # of the sheet and its notch [m]

# At rest to 1e-9 of the forces.
_BALANCE = 1e-6

_RUBBER = {
    "type": "neo-hookean",
    "youngs_modulus": 1e6,
    "poissons_ratio": 0.49,
    "density": 1000.0,
}


@final
@attrs.frozen
class NotchedSheet(Case):
    """A square sheet with a sharp notch in its left side, between two grips, at rest.

    What the stretch at the root of the notch and at the corners of the grips is depends on the
    spacing: both are singular. Neo-Hookean rubber has an equilibrium at any stretch, in which the
    sheet holds together: it is the notch that opens.
    """

    title = "A notched sheet of rubber"
    source = "the two grips carry the same force; matter does not turn inside out"
    sweep = {"across": (10, 20)}
    studies = {
        "hourglass": "beside the grips neighbours may move against each other from a stretch of "
        "3.5 on; one trial has control, which resists",
    }
    trials = {
        "to a stretch of 4": Trial(brief={"across": 10}),
        "to a stretch of 4, finer": Trial({"across": 40}),
        "to a stretch of 4, finer, with hourglass control": Trial(
            {"across": 40, "hourglass-control.strength": 0.5}
        ),
    }

    stretch: float = number(default=4.0)  # of the sheet at the end [-]
    across: int = 20  # spacings along a side

    def scenes(self) -> Mapping[str, Scene]:
        half = 0.5 * SIDE
        outside = -0.1 * SIDE
        wider = MOUTH * (DEPTH - outside) / (2.0 * DEPTH)
        notch = [[outside, half - wider], [DEPTH, half], [outside, half + wider]]
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "sheet",
                shape={
                    "type": "difference",
                    "of": {"type": "box", "lengths": [SIDE, SIDE]},
                    "minus": {"type": "polygon", "vertices": notch},
                },
                spacing=SIDE / self.across,
            )
            .material(_RUBBER)
            .boundary("clamp", where="bottom", label="foot")
            .boundary(
                "prescribed-motion",
                where="top",
                displacement={"x": 0.0, "y": f"{(self.stretch - 1.0) * SIDE!r}*t"},
                label="head",
            )
            .statics(load_steps=10)
            .duration(1.0)
        )
        return {"sheet": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["sheet"]
        pull, held = (record.history[f"{grip} reaction y [N]"][-1] for grip in ("head", "foot"))
        modulus = _RUBBER["youngs_modulus"]
        assert isinstance(modulus, float)
        J = np.asarray(record.field("volume_ratio")[-1])
        return [
            smallest_volume_ratio(record),
            vanishing(
                record,
                "sum of the forces of both grips over one of them",
                float((pull + held) / pull),
                _BALANCE,
                self.source,
            ),
            alone(record, "force over modulus and width", float(pull / (modulus * SIDE))),
            alone(record, "largest J of any particle at the end", float(J.max())),
        ]
