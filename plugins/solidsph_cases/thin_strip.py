"""A free strip of few particles across, bending to and fro."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._energy import energy_kept, smallest_volume_ratio
from solidsph_cases._scene import SOFT, box, check_count, solid

SPACING = 0.05  # [m]


@final
@attrs.frozen
class ThinStrip(Case):
    """The middle of a free strip is pushed aside; nothing else acts on it, and nothing damps it.

    Particles lie on both sides of it. One row, in the middle, has its neighbours in a line, which
    determine no gradient across: that must be refused, not guessed.
    """

    title = "A strip of few particles across"
    source = "conservation of energy"
    sweep = {"across": (2, 3, 5), "hourglass": (0.0, 0.1, 0.5)}
    trials = {
        "one particle across": Trial(
            {"across": 2, "discretisation": "lattice"},
            must_fail="neighbours in a line determine no gradient across it",
        ),
        "two particles across": Trial({"across": 2}, {"transits": 3.0}),
        "three particles across": Trial({"across": 3}, {"transits": 3.0}),
    }

    across: int = 3  # particles
    along: int = 31  # particles
    speed: float = number(default=0.02)  # of the middle, over the wave speed [-]
    transits: float = number(default=30.0)  # duration, in wave transits of the length
    energy_tolerance: float = number(default=5e-3)  # largest change that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("thin-strip", "across", self.across, 2)
        check_count("thin-strip", "along", self.along, 11)

    @property
    def resolution(self) -> float:
        return 1.0 / self.across

    def scenes(self) -> Mapping[str, Scene]:
        c, length = SOFT.wave_speed, SPACING * (self.along - 1)
        bump = f"exp(-(X - {0.5 * length!r})**2/{(0.15 * length) ** 2!r})"
        builder = (
            solid(self.title, "strip", box(length, SPACING * (self.across - 1)), SPACING, SOFT)
            .initial(velocity={"y": f"{self.speed * c!r}*{bump}"})
            .duration(self.transits * length / c)
        )
        return {"strip": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["strip"]
        return [energy_kept(record, self.energy_tolerance), smallest_volume_ratio(record)]
