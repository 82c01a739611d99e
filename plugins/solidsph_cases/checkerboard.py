"""A body whose particles start as a checkerboard, a motion that some gradients cannot see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import finished
from solidsph_cases._energy import energy_kept
from solidsph_cases._scene import SOFT, box, check_count, solid

SPACING = 0.1  # [m]

_STEP = 0.1  # of the critical step [-]

# How far alternating particles may come: a wave of two spacings has the frequency pi c / spacing,
# and one of a fifth of it is still a wave.
_SEEN = 0.2


@final
@attrs.frozen
class Checkerboard(Case):
    """Neighbours of a free body start in opposite directions, all at the same speed.

    In a solid that is the shortest wave: particles swing and stay where they are. A gradient that
    is blind to it sees no motion, and the particles go on as they started.
    """

    title = "A checkerboard start"
    source = "a wave of two spacings swings by v0 / omega, omega = pi c / spacing"
    studies = {
        "hourglass": "without it particles go 1.4 times as far as a wave would have them in 2D, "
        "1.1 times in 3D; with it 0.94 and 0.81 times",
        "time_step_factor": "all energy is in the fastest vibration, and wavers by a quarter of "
        "the square of its frequency times the step: 2.6 % at the default step, 0.05 % here",
    }
    sweep = {"particles": (9, 13), "hourglass": (0.1, 0.5, 1.0)}
    trials = {
        "2D": Trial(brief={"transits": 10.0}),
        "3D": Trial({"dimension": 3, "particles": 7}, {"transits": 5.0}),
        "2D, no hourglass control": Trial(
            {"hourglass": 0.0, "gradient": "corrected"},
            {"transits": 10.0},
            must_fail="the corrected gradient is blind to motions that alternate",
        ),
    }

    dimension: int = 2
    particles: int = 11  # along each side
    speed: float = number(default=1e-3)  # of each at the start, over the wave speed [-]
    transits: float = number(default=50.0)  # duration, in transits of a side
    energy_tolerance: float = number(default=1e-3)  # largest change that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("checkerboard", "particles", self.particles, 5)
        if self.dimension not in (2, 3):
            raise SceneError(f"case 'checkerboard': {self.dimension} dimensions; take 2 or 3")

    @property
    def resolution(self) -> float:
        return 1.0 / (self.particles - 1)

    def scenes(self) -> Mapping[str, Scene]:
        d, c = self.dimension, SOFT.wave_speed
        side = SPACING * (self.particles - 1)
        shape = box(*[side] * d)
        signs = "*".join(f"cos({pi / SPACING!r}*{name})" for name in "XYZ"[:d])
        builder = (
            solid(self.title, "body", shape, SPACING, SOFT)
            .initial(velocity=dict.fromkeys("xyz"[:d], f"{self.speed * c!r}*{signs}"))
            .effect("hourglass-control")
            .integrator(time_step_factor=_STEP)
            .duration(self.transits * side / c)
        )
        return {"body": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["body"]
        X = record.particles.positions
        signs = np.prod(np.cos(pi * X / SPACING), axis=1)
        u = record.positions[:] - X
        # The part of the motion that alternates from particle to particle.
        alternating = np.abs(np.einsum("tni,n->ti", u, signs) / len(X)).max()
        allowed = self.speed * SPACING / (pi * _SEEN)
        return [
            energy_kept(record, self.energy_tolerance),
            Measurement(
                "largest alternating displacement over what a wave makes of it",
                float(alternating / allowed),
                "1",
                source=self.source,
                verdict="a wave" if alternating <= allowed else "particles go on for ever",
                passed=finished(record) and bool(alternating <= allowed),
            ),
        ]
