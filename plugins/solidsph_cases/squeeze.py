"""A block squeezed to a fifth of its volume between frictionless walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scheme import (
    ON_BOUNDARY,
    SOFT,
    between_walls,
    box,
    check_count,
    in_motion,
    solid,
)

SIDE = 1.0  # [m]


@final
@attrs.frozen
class Squeeze(Case):
    """Every particle starts with the velocity that brings the block to J = 0.2 uniformly.

    x = X (1 - (1 - J) t / T) has no acceleration, so that it solves the equation of motion as it
    stands, whatever the law; the walls move with it. A scheme that is unstable in compression
    leaves it, by rounding alone.
    """

    title = "A block squeezed to a fifth"
    source = "uniform motion without acceleration; the law in closed form"
    sweep = {"particles": (7, 11, 15), "gradient": ("consistent", "quadratic", "corrected")}
    trials = {
        "to J = 0.2, 2D": Trial(
            known="with the sums of linear stresses of 'consistent' particles leave the uniform "
            "motion below J = 0.28; without them they hold to the end",
        ),
        "to J = 0.2, 3D": Trial({"dimension": 3, "particles": 6}),
        "to J = 0.2, particles off by 10 %": Trial(
            {"jitter": 0.1},
            known="particles in no order leave the uniform motion below J = 0.8, where the "
            "pressure outgrows the shear modulus and sums of cofactors do not cancel; "
            "hourglass = 30 with time_step_factor = 0.02 holds to J = 0.5",
        ),
    }

    dimension: int = 2
    particles: int = 11  # along each side
    volume_ratio: float = number(default=0.2)  # J at the end [-]
    transits: float = number(default=10.0)  # duration [transits of the side]
    jitter: float = number(default=0.0)  # how far particles are off their lattice [spacings]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.5)  # strength [-]; 0 adds none
    engine: str = "auto"
    integrator: str = "central-difference"
    # Of the largest step of the unloaded block: waves are faster in it the more it is squeezed.
    time_step_factor: float = number(default=0.05)
    tolerance: float = number(default=0.01)  # largest error of a stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("squeeze", "particles", self.particles, 5)
        if self.dimension not in (2, 3):
            raise SceneError(f"case 'squeeze': {self.dimension} dimensions; take 2 or 3")
        if not 0.05 <= self.volume_ratio < 1.0:
            raise SceneError(
                f"case 'squeeze': volume_ratio must be from 0.05 to 1, got {self.volume_ratio}"
            )

    def scenes(self) -> Mapping[str, Scene]:
        d, spacing = self.dimension, SIDE / (self.particles - 1)
        T = self.transits * SIDE / SOFT.wave_speed
        rate = (1.0 - self.volume_ratio) / T
        jittered = {"type": "jittered", "of": ON_BOUNDARY, "amplitude": self.jitter, "seed": 1}
        builder = (
            solid(self.title, "block", box(*[SIDE] * d), spacing, SOFT, discretisation=jittered)
            .boundary("clamp", where="left", axes=["x"])
            .boundary("prescribed-motion", where="right", displacement={"x": f"-{rate!r}*X*t"})
            .initial(velocity={"x": f"-{rate!r}*X"})
        )
        return {"block": in_motion(between_walls(builder, d), self, T, 100).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        F = np.eye(self.dimension)
        F[0, 0] = self.volume_ratio
        P = float(np.asarray(SOFT.first_piola(F, SOFT.params)[0][0]))
        stress = record.field("cauchy_stress")[-1][:, 0, 0]
        worst = float(stress[np.argmax(np.abs(stress / P - 1.0))])
        quantity = "Cauchy stress along the pull at the end, of the worst particle"
        return [
            compared(record, quantity, worst, "Pa", P, self.source, self.tolerance),
            smallest_volume_ratio(record),
        ]
