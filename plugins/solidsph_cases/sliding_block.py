"""A block on an incline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, radians, sin
from pathlib import Path
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._energy import residual_over_work
from solidsph_cases._scheme import check_count, with_scheme

LENGTH, HEIGHT = 0.2, 0.1  # [m]
GRAVITY = 9.81  # [m/s^2]
YOUNGS_MODULUS, POISSONS_RATIO, DENSITY = 1e6, 0.3, 1000.0  # [Pa], [-], [kg/m^3]

_OUTPUTS = 200
_TOLERANCE = 0.01
# Of the way that the block would slide without friction; it leans by its own weight, by about
# rho g sin t H^2 / (3 mu), which is a thousandth of that after 0.2 s.
_STAYS = 3e-3

_SOURCE = "Coulomb (1785): a = g (sin t - f cos t)"


@final
@attrs.frozen
class SlidingBlock(Case):
    """A block of rubber slides down an incline, and another one, less steep, holds its own block.

    Axes are turned with the incline: x points down it, gravity leans. The block is put down at
    the distance where it touches, and gravity grows with time until `ramp`: a block that is let
    fall at once trembles, and with a normal force that comes and goes it creeps, as real ones do.
    Both parts of the weight grow alike, so the law holds for the whole way. The steeper incline is
    above the angle of friction, atan f, the other one just below.
    """

    title: ClassVar[str] = "A block on an incline"
    source: ClassVar[str] = _SOURCE
    sweep: ClassVar[Mapping[str, Sequence[object]]] = {"along": (8, 12, 16)}
    trials: ClassVar[Mapping[str, Trial]] = {
        "slides, and sticks": Trial({}, {"along": 8, "duration": 0.2}),
    }

    friction: float = number(default=0.3)  # f [-]
    steep: float = number(default=30.0)  # angle at which it slides [degrees]
    flat: float = number(default=16.0)  # and at which it stays [degrees]
    along: int = 12  # particles along the block
    duration: float = number(default=0.4)  # [s]
    ramp: float = number(default=0.1)  # until gravity is whole [s]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "corrected"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    time_step_factor: float = number(default=0.5)  # of the CFL step

    def __attrs_post_init__(self) -> None:
        check_count("sliding-block", "along", self.along, 6)
        check_positive("sliding-block", "duration", self.duration, "s")
        check_positive("sliding-block", "ramp", self.ramp, "s")
        check_positive("sliding-block", "steep", self.steep, "degrees")
        check_positive("sliding-block", "flat", self.flat, "degrees")

    def scenes(self) -> Mapping[str, Scene]:
        return {"slides": self._scene(self.steep), "sticks": self._scene(self.flat)}

    def _scene(self, degrees: float) -> Scene:
        angle, grows = radians(degrees), f"min(t/{self.ramp!r}, 1)"
        builder = (
            Simulation.builder()
            .title(f"{self.title} of {degrees:g} degrees")
            .body(
                "block",
                shape={"type": "box", "lengths": [LENGTH, HEIGHT]},
                spacing=LENGTH / self.along,
            )
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=POISSONS_RATIO,
                density=DENSITY,
            )
            .effect(
                "body-force",
                acceleration={
                    "x": f"{GRAVITY * sin(angle)!r}*{grows}",
                    "y": f"-{GRAVITY * cos(angle)!r}*{grows}",
                },
                label="gravity",
            )
            .effect(
                "rigid-wall",
                point={"y": 0.0},
                normal={"y": 1.0},
                friction=self.friction,
                label="incline",
            )
            .integrator("velocity-verlet", time_step_factor=self.time_step_factor)
            .duration(self.duration)
            .outputs(_OUTPUTS)
        )
        return with_scheme(builder, self).scene()

    def moved(self, times: Array) -> Array:
        """By an acceleration of 1 m/s^2 that grows as gravity does, (t,) [m]."""
        T = self.ramp
        after = np.maximum(times - T, 0.0)
        return np.asarray(np.minimum(times, T) ** 3 / (6.0 * T) + 0.5 * T * after + 0.5 * after**2)

    @property
    def angle_of_friction(self) -> float:
        """atan f [degrees]"""
        return float(np.degrees(np.arctan(self.friction)))

    def acceleration(self, degrees: float) -> float:
        """Of a block that slides at that angle [m/s^2]."""
        angle = radians(degrees)
        return GRAVITY * (sin(angle) - self.friction * cos(angle))

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        slides, sticks = records["slides"], records["sticks"]
        way, stay = self.way(slides), self.way(sticks)
        # The least squares of the whole way.
        shape = self.moved(slides.times)
        found = float(way @ shape / (shape @ shape))
        free = GRAVITY * sin(radians(self.flat)) * float(self.moved(sticks.times)[-1])
        moved = float(np.abs(stay).max()) / free
        mass = DENSITY * LENGTH * HEIGHT
        heat = self.heat(slides)[-1]
        normal = mass * GRAVITY * cos(radians(self.steep))
        grown = np.minimum(slides.times / self.ramp, 1.0)
        rubbed = float(np.sum(0.5 * (grown[1:] + grown[:-1]) * np.diff(way)))
        return [
            compared(
                slides,
                f"acceleration at {self.steep:g} degrees",
                found,
                "m/s^2",
                self.acceleration(self.steep),
                _SOURCE,
                _TOLERANCE,
            ),
            Measurement(
                quantity="heat of friction over friction times the way",
                value=heat / (self.friction * normal * rubbed),
                unit="1",
                verdict="the rest makes the block tremble: nothing damps it",
                passed=slides.outcome == FINISHED,
            ),
            Measurement(
                quantity=f"largest way at {self.flat:g} degrees over that without friction",
                value=moved,
                unit="1",
                reference=0.0,
                source=f"the angle of friction is {self.angle_of_friction:.3g} degrees",
                error=moved,
                verdict="stays" if moved <= _STAYS else "slides",
                passed=sticks.outcome == FINISHED and moved <= _STAYS,
            ),
            residual_over_work(slides, "sliding"),
            residual_over_work(sticks, "sticking"),
        ]

    def way(self, record: Record) -> Array:
        """Of the centre of mass down the incline, (t,) [m]."""
        V = record.particles.volumes
        x = record.positions[:][:, :, 0] @ V / V.sum()
        return np.asarray(x - x[0])

    def heat(self, record: Record) -> Array:
        """What friction has taken and its springs do not hold, (t,) [J]."""
        held = record.history["incline energy [J]"]
        return np.asarray(-record.history["work of incline [J]"] - (held - held[0]))

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._contact_pictures import draw_block

        path = folder / "sliding-block.png"
        draw_block(records, self, path)
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        return {
            f"block-{name}": {"time [s]": record.times, "way [m]": self.way(record)}
            for name, record in records.items()
        }
