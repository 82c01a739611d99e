"""The smooth pulse of the wave bar alone: one run, one error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph_cases._bar_histories import SOURCE
from solidsph_cases._compare import compared
from solidsph_cases.wave_bar import STRAIN, WaveBar

_PULSE = "pulse"


@final
@attrs.frozen
class SmoothPulse(Case):
    """What of `wave-bar` is held against cost: its smooth pulse, to the wall and back."""

    title: ClassVar[str] = "A small, smooth stress wave in a bar"
    source: ClassVar[str] = SOURCE
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (61, 121, 241, 481, 961),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (1.6, 2.2, 3.5),
    }

    particles: int = 61
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.0)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.5)  # of the CFL step

    @classmethod
    def of(cls, case: WaveBar) -> SmoothPulse:
        """That of a case, with its parameters."""
        fields = attrs.fields_dict(cls)
        return cls(**{name: getattr(case, name) for name in fields})

    @property
    def _case(self) -> WaveBar:
        return WaveBar(**attrs.asdict(self), convergence=())

    def scenes(self) -> Mapping[str, Scene]:
        case = self._case
        return {_PULSE: case.loaded(STRAIN, case.pulses[0], self.particles).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records[_PULSE]
        error = self._case.error(record)
        quantity = "root mean square error of all stresses, relative"
        found = compared(record, quantity, error, "1", None, "", 0.0)
        return [attrs.evolve(found, source=SOURCE, error=error)]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
