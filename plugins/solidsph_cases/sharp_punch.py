"""A punch with sharp edges pressed into a metal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio

HALF_WIDTH = 5e-3  # of the punch [m]
YIELD_STRESS = 400e6  # [Pa]
PRANDTL = 2.0 + pi  # mean pressure over the yield stress in shear [-]


@final
@attrs.frozen
class SharpPunch(Case):
    """A rigid punch without friction on a block on a rough base, in plane strain, slowly.

    The metal does not harden, so the pressure has a limit, (2 + pi) k with k the yield stress in
    shear, as soon as the flow has come up beside the punch. Strains at its edges are singular: they
    grow as the spacing gets finer, and only the pressure is comparable. The block is wide, or its
    side would slide out along the base at a lower pressure.
    """

    title = "A sharp punch on a metal"
    source = "Prandtl (1920): (2 + pi) k"
    sweep = {"along": (4, 6, 9)}
    trials = {"to the limit load": Trial(brief={"along": 4, "width": 5.6, "transits": 25.0})}

    along: int = 5  # spacings along half the punch
    width: float = number(default=6.4)  # half that of the block [half widths of the punch]
    depth: float = number(default=0.05)  # of the punch at the end [half widths]
    transits: float = number(default=60.0)  # duration [transits of the height by shear waves]
    tolerance: float = number(default=0.08)  # largest error of the pressure that passes [-]

    def scenes(self) -> Mapping[str, Scene]:
        a = HALF_WIDTH
        height, wave_speed = 2.0 * a, 3100.0  # of shear waves in steel [m/s]
        T = self.transits * height / wave_speed
        punch = f"-{0.5 * self.depth * a!r}*(1 - cos({pi / T!r}*t))"
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={
                    "type": "box",
                    "lengths": [2.0 * self.width * a, height],
                    "origin": [-self.width * a, -height],
                },
                spacing=a / self.along,
                tags={"under": f"top and abs(X) < {1.01 * a!r}"},
            )
            .material(
                "j2-plasticity",
                youngs_modulus=200e9,
                poissons_ratio=0.3,
                density=7800.0,
                yield_stress=YIELD_STRESS,
            )
            .boundary("clamp", where="bottom")
            .boundary("prescribed-motion", where="under", displacement={"y": punch}, label="punch")
            .duration(T)
            .outputs(40)
        )
        return {"block": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        x = record.particles.positions[record.particles.tagged("under"), 0]
        # A particle belongs to the punch as a whole: so it is half a spacing wider at each end.
        width = float(np.ptp(x)) * (1.0 + 1.0 / (len(x) - 1))
        force = -float(record.history["punch reaction y [N]"][-1])
        pressure = force / width / (YIELD_STRESS / sqrt(3.0))
        quantity = "mean pressure over the yield stress in shear"
        return [
            compared(record, quantity, pressure, "1", PRANDTL, self.source, self.tolerance),
            smallest_volume_ratio(record),
        ]
