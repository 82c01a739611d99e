"""A bar, square or cube that vibrates for ever in its lowest standing wave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, pi
from typing import Any, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.statics import critical_step
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import finished, vanishing
from solidsph_cases._energy import energy_kept
from solidsph_cases._scene import (
    DISORDER,
    SOFT,
    between_walls,
    box,
    check_all_positive,
    check_count,
    disordered,
    solid,
)

LENGTH = 1.0  # [m]

_OUTPUTS = 400

# In more than one dimension: an energy that wavers by (omega step)^2 / 4, below 1e-3.
_PLANE: Mapping[str, Any] = {"particles": 21, "of_critical": 0.3}

# Of particles in no order the discrete standing wave differs from the smooth one, so that the rest
# swings too. That it does not grow is what is asked.
_IRREGULAR: Mapping[str, Any] = {"beside_tolerance": 0.1, **_PLANE}


@final
@attrs.frozen
class FreeVibration(Case):
    """u = A cos(pi X / L) cos(omega t) along a body that slides between frictionless walls.

    Confined across, so that it is the same in every dimension: omega = pi c / L, with the confined
    wave speed. Nothing acts on it and nothing damps it. The amplitude is so small that the law is
    linear; energy and amplitude are measured, the phase after many periods is not.
    """

    title = "A free vibration"
    source = "the standing wave of a confined bar"
    studies = {"time_step_factor": "steps near the critical one", **DISORDER}
    sweep = {"particles": (11, 21, 41), "gradient": ("consistent", "quadratic", "corrected")}
    trials = {
        "half the critical step": Trial({"of_critical": 0.5}),
        "nine tenths of the critical step": Trial({"of_critical": 0.9, "particles": 61}),
        "1.1 of the critical step": Trial(
            {"of_critical": 1.1, "dimension": 2, "particles": 21},
            must_fail="explicit steps beyond 2 / omega_max are refused",
        ),
        "float32": Trial({"engine": "compiled-float32", "dimension": 2, **_PLANE}),
        "a million steps": Trial({"periods": 5300.0}, {"periods": 50.0}),
        **{
            f"particles off by {100.0 * jitter:g} %, {d}D": Trial(
                {"jitter": jitter, "dimension": d, "periods": 5.0, **_IRREGULAR}, {"periods": 1.0}
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
    energy_tolerance: float = number(default=1e-3)  # largest change that passes [-]
    amplitude_tolerance: float = number(default=0.05)  # of the wave, relative to A [-]
    beside_tolerance: float = number(default=0.05)  # of all other motion, relative to A [-]

    def __attrs_post_init__(self) -> None:
        for name, least in (("dimension", 1), ("particles", 4), ("across", 4)):
            check_count("free-vibration", name, getattr(self, name), least)
        check_all_positive("free-vibration", self, periods="periods", of_critical="critical steps")
        if self.dimension > 3:
            raise SceneError(f"case 'free-vibration': {self.dimension} dimensions; take 1, 2 or 3")

    def scenes(self) -> Mapping[str, Scene]:
        if self.of_critical <= 1.0:
            return {"vibration": self._scene(time_step_factor=self.of_critical)}
        # Steps beyond the critical one are no factor of it: they are asked for in seconds.
        margin = critical_step(Simulation.builder(self._scene(time_step_factor=0.5)).build())
        return {"vibration": self._scene(time_step=self.of_critical * margin.step)}

    def _scene(self, **steps: float) -> Scene:
        d, spacing = self.dimension, LENGTH / (self.particles - 1)
        shape: Mapping[str, Any] = {"type": "interval", "length": LENGTH}
        if d > 1:
            shape = box(LENGTH, *[spacing * (self.across - 1)] * (d - 1))
        builder = (
            solid(self.title, "body", shape, spacing, SOFT)
            .initial(displacement={"x": f"{self.amplitude * LENGTH!r}*cos({pi / LENGTH!r}*X)"})
            .duration(self.periods * (2.0 * LENGTH / SOFT.wave_speed))
            .outputs(min(_OUTPUTS, ceil(20 * self.periods)))
            .integrator(**steps)
        )
        return disordered(between_walls(builder, d).scene(), self.jitter)

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["vibration"]
        X = record.particles.positions[:, 0]
        shape = np.cos(pi * X / LENGTH)
        u = record.positions[:][:, :, 0] - X
        amplitudes = u @ shape / (shape @ shape)
        A = self.amplitude * LENGTH
        beside = float(np.abs(u - amplitudes[:, None] * shape).max() / A)

        def swing(quantity: str, largest: float) -> Measurement:
            value = float(largest / A)
            passed = finished(record) and abs(value - 1.0) <= self.amplitude_tolerance
            error = abs(value - 1.0)
            return Measurement(quantity, value, "1", 1.0, self.source, error, passed=passed)

        return [
            energy_kept(record, self.energy_tolerance),
            # The late half swings as far as the early one.
            swing(
                "amplitude of the late half over that of the start",
                np.abs(amplitudes[len(amplitudes) // 2 :]).max(),
            ),
            swing("largest amplitude over that of the start", np.abs(amplitudes).max()),
            vanishing(
                record,
                "largest displacement beside the wave over its amplitude",
                beside,
                self.beside_tolerance,
                self.source,
            ),
        ]
