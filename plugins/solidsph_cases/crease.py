"""A rubber block pressed from its sides until its free surface gives way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scene import box, check_count, solid

WIDTH, HEIGHT = 2.0, 1.0  # [m]
MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.45, density=1000.0)

# Stretch at which the surface of an incompressible neo-Hookean half-space in plane strain loses
# its stability: the real root of x^3 + x^2 + 3 x - 1 for x = stretch^2 (Biot 1963).
BIOT = float(np.sqrt(next(r.real for r in np.roots([1.0, 1.0, 3.0, -1.0]) if abs(r.imag) < 1e-9)))

# Waves of the imperfection along the width.
_WAVES = 5.0

# Unevenness from which the surface is no longer flat; a flat one has its imperfection, some 1e-3.
_ROUGH = 0.02


@final
@attrs.frozen
class Crease(Case):
    """Frictionless walls press the sides together; the foot slides, the top is free.

    Above Biot's stretch of 0.544 a flat surface is stable, below it wrinkles and creases: the
    physics itself is unstable there. The surface then snaps, and viscosity takes what that sets
    free, as in a shock; without it runs diverge at a stretch of 0.47. The run must get through
    without a place turning inside out and without energy from nowhere.
    """

    title = "A creasing surface"
    source = "Biot (1963): a surface gives way at a stretch of 0.544"
    sweep = {"across": (11, 15), "gradient": ("consistent", "quadratic", "corrected")}
    trials = {
        "to a stretch of 0.7": Trial({"stretch": 0.7}, {"across": 8, "transits": 15.0}),
        "to a stretch of 0.45": Trial(brief={"across": 9, "transits": 20.0}),
    }

    stretch: float = number(default=0.45)  # of the width at the end [-]
    transits: float = number(default=40.0)  # duration [wave transits of the width]
    imperfection: float = number(default=2e-3)  # of the surface at the start, over the height [-]
    across: int = 15  # particles from the foot to the top
    damping: float = number(default=0.2)  # rate of mass damping, over c / width [-]

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
        bumps = f"cos({_WAVES * 2.0 * np.pi / WIDTH!r}*X)"
        uneven = f"{self.imperfection * HEIGHT!r}*(Y/{HEIGHT!r})**4*{bumps}"
        shape = box(WIDTH, HEIGHT, origin=[-0.5 * WIDTH, 0.0])
        spacing = HEIGHT / (self.across - 1)
        builder = (
            solid(self.title, "block", shape, spacing, MATERIAL)
            .boundary("clamp", where="bottom", axes=["y"])
            .initial(displacement={"y": uneven})
            .effect("mass-damping", rate=self.damping * c / WIDTH)
            .effect("artificial-viscosity")
            .duration(T)
            .outputs(100)
        )
        for side, sign in (("left", "+"), ("right", "-")):
            motion = {"x": f"{sign}{way * WIDTH!r}*{ramp}"}
            builder = builder.boundary("prescribed-motion", where=side, displacement=motion)
        return {"block": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        # Standard deviation of the height of the free surface over the height, at every time.
        top = record.particles.tagged("top")
        uneven = np.std(record.positions[:][:, top, 1], axis=1) / HEIGHT
        stretches = np.ptp(record.positions[:][:, :, 0], axis=1) / WIDTH
        rough = uneven > _ROUGH
        at = float(stretches[rough][0]) if rough.any() else nan
        return [
            smallest_volume_ratio(record),
            Measurement(
                "unevenness of the surface at the end, over the height",
                float(uneven[-1]),
                "1",
                source=self.source,
                verdict=f"gives way at a stretch of {at:.3f}" if rough.any() else "flat",
                # Flat well above Biot's stretch; below it nothing is asked.
                passed=not (bool(rough[-1]) and self.stretch > 1.1 * BIOT),
            ),
        ]
