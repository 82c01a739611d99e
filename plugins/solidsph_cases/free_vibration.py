"""A bar, square or cube that vibrates for ever in its lowest standing wave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, pi
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.statics import critical_step
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import FINISHED
from solidsph_cases._energy import energy_kept
from solidsph_cases._scheme import check_count, with_scheme

LENGTH = 1.0  # [m]
MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)

_OUTPUTS = 400

# In more than one dimension: an energy that wavers by (omega step)^2 / 4, below 1e-3.
_PLANE: Mapping[str, Any] = {"particles": 21, "of_critical": 0.3}

# Of particles in no order the discrete standing wave is another than the smooth one, so that the
# rest swings too. That it does not grow is what is asked.
_IRREGULAR = 0.3


@final
@attrs.frozen
class FreeVibration(Case):
    """u = A cos(pi X / L) cos(omega t) along a body that slides between frictionless walls.

    Confined across, so that it is the same in every dimension: omega = pi c / L, with the confined
    wave speed. Nothing acts on it and nothing damps it. The amplitude is small, so that the law is
    as good as linear; what a scheme adds in phase over many periods is not asked for, what it adds
    in energy and amplitude is.
    """

    title: ClassVar[str] = "A free vibration"
    source: ClassVar[str] = "the standing wave of a confined bar"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (11, 21, 41),
        "gradient": ("consistent", "quadratic", "corrected"),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "half the critical step": Trial({"of_critical": 0.5}),
        "nine tenths of the critical step": Trial({"of_critical": 0.9, "particles": 61}),
        "1.1 of the critical step": Trial(
            {"of_critical": 1.1, "dimension": 2, "particles": 21},
            must_fail="explicit steps beyond 2 / omega_max grow without limit",
        ),
        "float32": Trial({"engine": "compiled-float32", "dimension": 2, **_PLANE}),
        "a million steps": Trial({"periods": 5300.0}, {"periods": 50.0}),
        **{
            f"particles off by {100.0 * jitter:g} %, {d}D": Trial(
                {
                    "jitter": jitter,
                    "dimension": d,
                    "periods": 5.0,
                    "beside_tolerance": _IRREGULAR,
                    **_PLANE,
                },
                {"periods": 1.0},
            )
            for jitter in (0.1, 0.3)
            for d in (2, 3)
        },
    }

    dimension: int = 1
    particles: int = 41  # along the wave
    across: int = 6  # and across it, in more than one dimension
    amplitude: float = number(default=1e-3)  # A over L [-]
    periods: float = number(default=10.0)  # duration
    jitter: float = number(default=0.0)  # how far particles are off their lattice [spacings]
    of_critical: float = number(default=0.5)  # time step over the largest stable one [-]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    energy_tolerance: float = number(default=1e-3)  # largest change that passes [-]
    amplitude_tolerance: float = number(default=0.05)  # of the wave, relative to A [-]
    beside_tolerance: float = number(default=0.05)  # of all other motion, relative to A [-]

    def __attrs_post_init__(self) -> None:
        check_count("free-vibration", "dimension", self.dimension, 1)
        check_count("free-vibration", "particles", self.particles, 4)
        check_count("free-vibration", "across", self.across, 4)
        check_positive("free-vibration", "periods", self.periods, "periods")
        check_positive("free-vibration", "of_critical", self.of_critical, "critical steps")
        if self.dimension > 3:
            raise SceneError(f"case 'free-vibration': {self.dimension} dimensions; take 1, 2 or 3")

    @property
    def period(self) -> float:
        """[s]"""
        return 2.0 * LENGTH / MATERIAL.wave_speed

    def scenes(self) -> Mapping[str, Scene]:
        scene = self._scene(None)
        margin = critical_step(Simulation.builder(scene).build())
        return {"vibration": self._scene(self.of_critical * margin.step)}

    def _scene(self, step: float | None) -> Scene:
        d = self.dimension
        spacing = LENGTH / (self.particles - 1)
        lattice: dict[str, Any] = {"type": "lattice", "on_boundary": True}
        across = spacing * (self.across - 1)
        shape: dict[str, Any] = (
            {"type": "interval", "length": LENGTH}
            if d == 1
            else {"type": "box", "lengths": [LENGTH, *[across] * (d - 1)]}
        )
        if self.jitter:
            lattice = {"type": "jittered", "of": lattice, "amplitude": self.jitter, "seed": 1}
        builder = (
            Simulation.builder()
            .title(self.title)
            .body("body", shape=shape, spacing=spacing, discretisation=lattice)
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .initial(displacement={"x": f"{self.amplitude * LENGTH!r}*cos({pi / LENGTH!r}*X)"})
            .duration(self.periods * self.period)
            .outputs(min(_OUTPUTS, ceil(20 * self.periods)))
        )
        for axis, sides in (("y", ("bottom", "top")), ("z", ("back", "front"))):
            if "xyz".index(axis) < d:
                for side in sides:
                    builder = builder.boundary("clamp", where=side, axes=[axis])
        steps = {"time_step_factor": 0.5} if step is None else {"time_step": step}
        return with_scheme(builder.integrator(self.integrator, **steps), self).scene()

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["vibration"]
        X = record.particles.positions[:, 0]
        shape = np.cos(pi * X / LENGTH)
        u = record.positions[:][:, :, 0] - X
        amplitudes = u @ shape / (shape @ shape)
        A = self.amplitude * LENGTH
        rest = np.abs(u - amplitudes[:, None] * shape).max()
        largest = float(np.abs(amplitudes).max() / A)
        beside = float(rest / A)
        # The late half swings as far as the early one.
        late = float(np.abs(amplitudes[len(amplitudes) // 2 :]).max() / A)
        done = record.outcome == FINISHED
        return [
            energy_kept(record, self.energy_tolerance),
            Measurement(
                quantity="amplitude of the late half over that of the start",
                value=late,
                unit="1",
                reference=1.0,
                source=self.source,
                error=abs(late - 1.0),
                passed=done and abs(late - 1.0) <= self.amplitude_tolerance,
            ),
            Measurement(
                quantity="largest amplitude over that of the start",
                value=largest,
                unit="1",
                reference=1.0,
                source=self.source,
                error=abs(largest - 1.0),
                passed=done and abs(largest - 1.0) <= self.amplitude_tolerance,
            ),
            Measurement(
                quantity="largest displacement beside the wave over its amplitude",
                value=beside,
                unit="1",
                reference=0.0,
                source=self.source,
                error=beside,
                passed=done and beside <= self.beside_tolerance,
            ),
        ]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
