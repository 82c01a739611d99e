"""A block squeezed to a fifth of its volume between walls that do not rub."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scheme import check_count, with_scheme

MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
SIDE = 1.0  # [m]


@final
@attrs.frozen
class Squeeze(Case):
    """Every particle starts with the velocity that brings the block to J = 0.2 uniformly.

    x = X (1 - (1 - J) t / T) has no acceleration, so that it solves the equation of motion as it
    stands, whatever the law; the walls move with it. A scheme that is unstable in compression
    leaves it, by rounding alone.
    """

    title: ClassVar[str] = "A block squeezed to a fifth"
    source: ClassVar[str] = "uniform motion without acceleration; the law in closed form"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (7, 11, 15),
        "gradient": ("consistent", "quadratic", "corrected"),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "to J = 0.2, 2D": Trial(),
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
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    # Of the CFL step of the unloaded block: waves are faster in it the more it is squeezed.
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
        d = self.dimension
        T = self.transits * SIDE / MATERIAL.wave_speed
        rate = (1.0 - self.volume_ratio) / T
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={"type": "box", "lengths": [SIDE] * d},
                spacing=SIDE / (self.particles - 1),
                discretisation={
                    "type": "jittered",
                    "of": {"type": "lattice", "on_boundary": True},
                    "amplitude": self.jitter,
                    "seed": 1,
                },
            )
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .boundary("clamp", where="left", axes=["x"])
            .boundary("prescribed-motion", where="right", displacement={"x": f"-{rate!r}*X*t"})
            .initial(velocity={"x": f"-{rate!r}*X"})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(T)
            .outputs(100)
        )
        for axis, sides in (("y", ("bottom", "top")), ("z", ("back", "front"))):
            if "xyz".index(axis) < d:
                for side in sides:
                    builder = builder.boundary("clamp", where=side, axes=[axis])
        return {"block": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        J = self.volume_ratio
        F = np.eye(self.dimension)
        F[0, 0] = J
        P = float(np.asarray(MATERIAL.first_piola(F, MATERIAL.params)[0][0]))
        stress = record.field("cauchy_stress")[-1][:, 0, 0]
        worst = float(stress[np.argmax(np.abs(stress / P - 1.0))])
        found = compared(
            record,
            "Cauchy stress along the pull at the end, of the worst particle",
            worst,
            "Pa",
            P,
            self.source,
            self.tolerance,
        )
        return [found, smallest_volume_ratio(record)]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
