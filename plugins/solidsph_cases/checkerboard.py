"""A body whose particles start as a checkerboard, which a blind gradient does not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import FINISHED
from solidsph_cases._energy import energy_kept
from solidsph_cases._scheme import check_count, with_scheme

MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
SPACING = 0.1  # [m]

# How far alternating particles may come: a wave of two spacings has the frequency pi c / spacing,
# and one of a fifth of it is still a wave.
_SEEN = 0.2


@final
@attrs.frozen
class Checkerboard(Case):
    """Neighbours start in opposite directions, each as fast as the others; the body is free.

    In a solid that is the shortest wave there is: particles swing and stay where they are. To a
    gradient that is blind to it nothing happens, and they go on as they started, apart for ever.
    """

    title: ClassVar[str] = "A checkerboard start"
    source: ClassVar[str] = "a wave of two spacings swings by v0 / omega, omega = pi c / spacing"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (9, 13),
        "hourglass": (0.1, 0.5, 1.0),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
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
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "quadratic"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.05)  # of the CFL step
    energy_tolerance: float = number(default=1e-3)  # largest change that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("checkerboard", "particles", self.particles, 5)
        if self.dimension not in (2, 3):
            raise SceneError(f"case 'checkerboard': {self.dimension} dimensions; take 2 or 3")

    @property
    def side(self) -> float:
        """[m]"""
        return SPACING * (self.particles - 1)

    @property
    def resolution(self) -> float:
        return 1.0 / (self.particles - 1)

    def scenes(self) -> Mapping[str, Scene]:
        d, c = self.dimension, MATERIAL.wave_speed
        names = ("X", "Y", "Z")[:d]
        signs = "*".join(f"cos({pi / SPACING!r}*{name})" for name in names)
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "body",
                shape={"type": "box", "lengths": [self.side] * d},
                spacing=SPACING,
                discretisation={"type": "lattice", "on_boundary": True},
            )
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .initial(velocity={"xyz"[i]: f"{self.speed * c!r}*{signs}" for i in range(d)})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.transits * self.side / c)
            .outputs(200)
        )
        return {"body": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["body"]
        X = record.particles.positions
        signs = np.prod(np.cos(pi * X / SPACING), axis=1)
        u = record.positions[:] - X
        # What of the motion alternates from particle to particle.
        alternating = np.abs(np.einsum("tni,n->ti", u, signs) / len(X)).max()
        allowed = self.speed * SPACING / (pi * _SEEN)
        return [
            energy_kept(record, self.energy_tolerance),
            Measurement(
                quantity="largest alternating displacement over what a wave makes of it",
                value=float(alternating / allowed),
                unit="1",
                source=self.source,
                verdict="a wave" if alternating <= allowed else "particles go on for ever",
                passed=record.outcome == FINISHED and bool(alternating <= allowed),
            ),
        ]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
