"""One bar hits another one, of its own kind and at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_builtin.materials.linear_elastic import LinearElastic
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._energy import residual_over_start
from solidsph_cases._scheme import check_count, with_scheme

LENGTH = 1.0  # of each bar [m]
MATERIAL = LinearElastic(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)

# Time of flight before the contact, and whole duration, in transits L / c.
BEFORE, _DURATION = 0.1, 3.0
_OUTPUTS = 300
_TOLERANCE = 0.02

_SOURCE = "Saint-Venant (1867): waves of two equal bars"
FORCE = "contact force of first on second x [N]"


@final
@attrs.frozen
class CollidingBars(Case):
    """Two equal bars of linear material, confined across, the first with the velocity v.

    At the contact both ends move with v / 2, under the stress rho c v / 2. Two waves of that
    height run to the far ends and back, and when they return, after 2 L / c, the bars part: the
    first is at rest, the second moves with v, and no energy is left in vibrations. In 2D the
    bars are strips between frictionless walls.
    """

    title: ClassVar[str] = "Two bars collide"
    source: ClassVar[str] = _SOURCE
    sweep: ClassVar[Mapping[str, Sequence[object]]] = {"particles": (25, 50, 100, 200)}
    trials: ClassVar[Mapping[str, Trial]] = {
        "1D": Trial({}, {"particles": 50}),
        "strips": Trial({"dimension": 2}, {"particles": 50}),
    }

    dimension: int = 1
    particles: int = 100  # along each bar
    across: int = 6  # and across it, in 2D
    speed: float = number(default=0.01)  # v over the wave speed [-]
    strength: float = number(default=1.0)  # of the contact [-]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "corrected"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    time_step_factor: float = number(default=0.5)  # of the CFL step

    def __attrs_post_init__(self) -> None:
        check_count("colliding-bars", "particles", self.particles, 10)
        check_count("colliding-bars", "across", self.across, 4)
        check_positive("colliding-bars", "speed", self.speed, "parts of the wave speed")
        if self.dimension not in (1, 2):
            raise SceneError(f"case 'colliding-bars': {self.dimension} dimensions; take 1 or 2")

    @property
    def velocity(self) -> float:
        """v [m/s]"""
        return self.speed * MATERIAL.wave_speed

    @property
    def transit(self) -> float:
        """L / c [s]"""
        return LENGTH / MATERIAL.wave_speed

    @property
    def width(self) -> float:
        """Of a strip [m]; a bar in 1D has a section of 1 m^2."""
        return self.across * LENGTH / self.particles if self.dimension == 2 else 1.0

    @property
    def plateau(self) -> float:
        """The force of contact, rho c v A / 2 [N]"""
        return 0.5 * MATERIAL.density * MATERIAL.wave_speed * self.velocity * self.width

    def scenes(self) -> Mapping[str, Scene]:
        builder = Simulation.builder().title(self.title)
        gap = self.velocity * BEFORE * self.transit
        for name, start in (("first", -LENGTH - gap), ("second", 0.0)):
            shape = (
                {"type": "interval", "length": LENGTH, "origin": start}
                if self.dimension == 1
                else {"type": "box", "lengths": [LENGTH, self.width], "origin": [start, 0.0]}
            )
            builder = builder.body(name, shape=shape, spacing=LENGTH / self.particles)
        if self.dimension == 2:
            builder = builder.boundary("clamp", where="all", axes=["y"])
        builder = (
            builder.material(
                "linear-elastic",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .effect("contact", strength=self.strength)
            .initial(where=f"X < {-0.5 * gap!r}", velocity={"x": self.velocity})
            .integrator("central-difference", time_step_factor=self.time_step_factor)
            .duration(_DURATION * self.transit)
            .outputs(_OUTPUTS)
        )
        return {"bars": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bars"]
        plateau = self.plateau
        times, force = record.times, record.history[FORCE]
        above = force > 0.5 * plateau
        lasted, middle = float("nan"), float("nan")
        if above.any():
            lasted = _crossing(times, force, 0.5 * plateau, last=True) - _crossing(
                times, force, 0.5 * plateau, last=False
            )
            between = (times > times[above][0]) & (times < times[above][-1])
            middle = float(force[between].mean())
        velocities = self.mean_velocities(record)[-1] / self.velocity
        done = record.outcome == FINISHED
        momenta = self.mean_velocities(record).sum(axis=1) / self.velocity
        lost = float(np.abs(momenta / momenta[0] - 1.0).max())
        return [
            compared(
                record,
                "time of contact, at half the force",
                lasted,
                "s",
                2.0 * self.transit,
                _SOURCE,
                _TOLERANCE,
            ),
            compared(record, "force of contact", middle, "N", plateau, _SOURCE, _TOLERANCE),
            compared(
                record, "velocity of the bar hit", velocities[1], "v", 1.0, _SOURCE, _TOLERANCE
            ),
            Measurement(
                quantity="velocity of the bar that hit",
                value=float(velocities[0]),
                unit="v",
                reference=0.0,
                source=_SOURCE,
                error=float(abs(velocities[0])),
                passed=done and abs(velocities[0]) <= _TOLERANCE,
            ),
            Measurement(
                quantity="largest relative change of momentum",
                value=lost,
                unit="1",
                reference=0.0,
                source="nothing acts from outside",
                error=lost,
                passed=done and lost <= 1e-10,  # rounding of some thousand steps
            ),
            Measurement(
                quantity="energy left in vibrations over that at the start",
                value=float(1.0 - np.sum(velocities**2)),
                unit="1",
                verdict="a sharp front sheds some",
                passed=done,
            ),
            residual_over_start(record),
        ]

    def mean_velocities(self, record: Record) -> Array:
        """Of both bars along the axis, (t, 2) [m/s]."""
        v = record.field("velocity")[:][:, :, 0]
        bodies = record.particles.bodies
        return np.column_stack([v[:, bodies[name]].mean(axis=1) for name in ("first", "second")])

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._contact_pictures import draw_bars

        path = folder / "colliding-bars.png"
        draw_bars(records["bars"], self, path)
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        record = records["bars"]
        first, second = self.mean_velocities(record).T
        return {
            "colliding-bars": {
                "time [s]": record.times,
                "force of contact [N]": record.history[FORCE],
                "mean velocity of the first [m/s]": first,
                "mean velocity of the second [m/s]": second,
            }
        }


def _crossing(times: Array, values: Array, level: float, *, last: bool) -> float:
    """When `values` first rise above `level`, or last fall below it, by a straight line [s]."""
    above = np.flatnonzero(values > level)
    k = int(above[-1]) if last else int(above[0])
    other = k + 1 if last else k - 1
    if not 0 <= other < len(values):
        return float(times[k])
    part = (level - values[k]) / (values[other] - values[k])
    return float(times[k] + part * (times[other] - times[k]))
