"""A rubber block pressed from its sides until its free surface gives way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scheme import check_count, with_scheme

WIDTH, HEIGHT = 2.0, 1.0  # [m]
MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.45, density=1000.0)

# Stretch at which the surface of an incompressible neo-Hookean half-space in plane strain loses
# its stability: the real root of x^3 + x^2 + 3 x - 1 for x = stretch^2 (Biot 1963).
BIOT = float(np.sqrt(next(r.real for r in np.roots([1.0, 1.0, 3.0, -1.0]) if abs(r.imag) < 1e-9)))

# Waves of the imperfection along the width.
_WAVES = 5.0

# Over which the surface is no longer flat; a flat one has its imperfection, some 1e-3.
_ROUGH = 0.02


@final
@attrs.frozen
class Crease(Case):
    """Walls that do not rub press the sides together; the foot slides, the top is free.

    Above Biot's stretch of 0.544 a flat surface is stable, below it wrinkles and creases: the
    physics itself is unstable there, and no method may hide it. What is asked is that the run gets
    through, without a place turning inside out and without energy from nowhere.
    """

    title: ClassVar[str] = "A creasing surface"
    source: ClassVar[str] = "Biot (1963): a surface gives way at a stretch of 0.544"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (11, 15),
        "gradient": ("consistent", "quadratic", "corrected"),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "to a stretch of 0.7": Trial({"stretch": 0.7}, {"across": 8, "transits": 15.0}),
        "to a stretch of 0.45": Trial(brief={"across": 9, "transits": 20.0}),
    }

    stretch: float = number(default=0.45)  # of the width at the end [-]
    transits: float = number(default=40.0)  # duration [wave transits of the width]
    imperfection: float = number(default=2e-3)  # of the surface at the start, over the height [-]
    across: int = 15  # particles from the foot to the top
    damping: float = number(default=0.2)  # rate of mass damping, over c / width [-]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.2)  # of the CFL step

    def __attrs_post_init__(self) -> None:
        check_count("crease", "across", self.across, 7)
        if not 0.2 <= self.stretch < 1.0:
            raise SceneError(f"case 'crease': stretch must be from 0.2 to 1, got {self.stretch}")

    def scenes(self) -> Mapping[str, Scene]:
        c = MATERIAL.wave_speed
        T = self.transits * WIDTH / c
        # At rest at both ends of the time: no shock from the start.
        ramp = f"(1 - cos({np.pi / T!r}*t))/2"
        way = 0.5 * (1.0 - self.stretch)
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={
                    "type": "box",
                    "lengths": [WIDTH, HEIGHT],
                    "origin": [-0.5 * WIDTH, 0.0],
                },
                spacing=HEIGHT / (self.across - 1),
                discretisation={"type": "lattice", "on_boundary": True},
            )
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .boundary("clamp", where="bottom", axes=["y"])
            .initial(
                displacement={
                    "y": f"{self.imperfection * HEIGHT!r}*(Y/{HEIGHT!r})**4"
                    f"*cos({_WAVES * 2.0 * np.pi / WIDTH!r}*X)"
                }
            )
            .effect("mass-damping", rate=self.damping * c / WIDTH)
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(T)
            .outputs(100)
        )
        for side, sign in (("left", "+"), ("right", "-")):
            builder = builder.boundary(
                "prescribed-motion",
                where=side,
                displacement={"x": f"{sign}{way * WIDTH!r}*{ramp}"},
            )
        return {"block": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        uneven = self.unevenness(record)
        rough = bool(uneven[-1] > _ROUGH)
        given_way = np.flatnonzero(uneven > _ROUGH)
        at = self.stretches(record)[given_way[0]] if len(given_way) else float("nan")
        said = f"gives way at a stretch of {at:.3f}" if len(given_way) else "flat"
        return [
            smallest_volume_ratio(record),
            Measurement(
                quantity="unevenness of the surface at the end, over the height",
                value=float(uneven[-1]),
                unit="1",
                source=self.source,
                verdict=said,
                # Flat well above Biot's stretch; what it does below is its own affair.
                passed=not (rough and self.stretch > 1.1 * BIOT),
            ),
        ]

    def stretches(self, record: Record) -> Array:
        """Of the width at every time, (t,) [-]."""
        x = record.positions[:][:, :, 0]
        stretches: Array = np.ptp(x, axis=1) / WIDTH
        return stretches

    def unevenness(self, record: Record) -> Array:
        """Standard deviation of the height of the free surface over the height, (t,) [-]."""
        top = record.particles.tagged("top")
        uneven: Array = np.std(record.positions[:][:, top, 1], axis=1) / HEIGHT
        return uneven

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
