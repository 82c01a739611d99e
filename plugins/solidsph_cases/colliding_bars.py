"""One bar hits another one, of its own kind and at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import nan
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.construct import describe
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_builtin.materials.linear_elastic import LinearElastic
from solidsph_cases._compare import compared, finished, vanishing
from solidsph_cases._energy import residual_over_start
from solidsph_cases._scene import box, check_all_positive, check_count
from solidsph_cases.drawing.sheet import Panel, Sheet, line

LENGTH = 1.0  # of each bar [m]
MATERIAL = LinearElastic(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)

# Time of flight before the contact, and whole duration, in transits L / c.
_BEFORE, _DURATION = 0.1, 3.0
_OUTPUTS = 300
_TOLERANCE = 0.02

_SOURCE = "Saint-Venant (1867): waves of two equal bars"
_FORCE = "contact force of first on second x [N]"


@final
@attrs.frozen
class CollidingBars(Case):
    """Two equal bars of linear material, confined across, the first with the velocity v.

    At the contact both ends move with v / 2, under the stress rho c v / 2. Two waves of that
    height run to the far ends and back, and when they return, after 2 L / c, the bars part: the
    first is at rest, the second moves with v, and no energy is left in vibrations. In 2D the
    bars are strips between frictionless walls.
    """

    title = "Two bars collide"
    source = _SOURCE
    sweep = {"particles": (25, 50, 100, 200)}
    trials = {
        "1D": Trial({}, {"particles": 50}),
        "strips": Trial({"dimension": 2}, {"particles": 50}),
    }

    dimension: int = 1
    particles: int = 100  # along each bar
    across: int = 6  # and across it, in 2D
    speed: float = number(default=0.01)  # v over the wave speed [-]
    strength: float = number(default=1.0)  # of the contact [-]

    def __attrs_post_init__(self) -> None:
        check_count("colliding-bars", "particles", self.particles, 10)
        check_count("colliding-bars", "across", self.across, 4)
        check_all_positive("colliding-bars", self, speed="parts of the wave speed")
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
        gap = self.velocity * _BEFORE * self.transit
        for name, start in (("first", -LENGTH - gap), ("second", 0.0)):
            shape = (
                {"type": "interval", "length": LENGTH, "origin": start}
                if self.dimension == 1
                else box(LENGTH, self.width, origin=[start, 0.0])
            )
            builder = builder.body(name, shape=shape, spacing=LENGTH / self.particles)
        if self.dimension == 2:
            builder = builder.boundary("clamp", where="all", axes=["y"])
        builder = (
            builder.material(describe("materials", MATERIAL))
            .effect("contact", strength=self.strength)
            .initial(where=f"X < {-0.5 * gap!r}", velocity={"x": self.velocity})
            .duration(_DURATION * self.transit)
            .outputs(_OUTPUTS)
        )
        return {"bars": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bars"]
        times, force = record.times, record.history[_FORCE]
        above = force > 0.5 * self.plateau
        lasted, middle = nan, nan
        if above.any():
            begin, end = (
                _crossing(times, force, 0.5 * self.plateau, last=x) for x in (False, True)
            )
            lasted = end - begin
            between = (times > times[above][0]) & (times < times[above][-1])
            middle = float(force[between].mean())
        means = self.mean_velocities(record)
        momenta = means.sum(axis=1) / self.velocity
        lost = float(np.abs(momenta / momenta[0] - 1.0).max())
        hitting, hit = velocities = means[-1] / self.velocity
        compare = partial(compared, record, source=_SOURCE, tolerance=_TOLERANCE)
        return [
            compare("time of contact, at half the force", lasted, "s", 2.0 * self.transit),
            compare("force of contact", middle, "N", self.plateau),
            compare("velocity of the bar hit", hit, "v", 1.0),
            vanishing(
                record, "velocity of the bar that hit", hitting, _TOLERANCE, _SOURCE, unit="v"
            ),
            vanishing(
                record,
                "largest relative change of momentum",
                lost,
                1e-10,  # rounding of some thousand steps
                "nothing acts from outside",
            ),
            Measurement(
                "energy left in vibrations over that at the start",
                float(1.0 - np.sum(velocities**2)),
                "1",
                verdict="a sharp front sheds some",
                passed=finished(record),
            ),
            residual_over_start(record),
        ]

    def mean_velocities(self, record: Record) -> Array:
        """Of both bars along the axis, (t, 2) [m/s]."""
        particles = record.particles
        v, V = record.field("velocity")[:][:, :, 0], particles.volumes
        rows = (particles.bodies[name] for name in ("first", "second"))
        return np.column_stack([v[:, row] @ V[row] / V[row].sum() for row in rows])

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The force of contact and both mean velocities against time, in transits."""
        record = records["bars"]
        t = record.times / self.transit - _BEFORE
        first, second = self.mean_velocities(record).T / self.velocity
        part = 0.5 * np.clip(t, 0.0, 2.0)
        law = {"color": "tab:orange", "linewidth": 1.5}
        force = Panel(
            line(t, record.history[_FORCE] / self.plateau, linewidth=1.0, label="simulated"),
            line(t, (t > 0.0) & (t < 2.0), "--", **law, label="waves of two bars"),
            x="time since the contact [L / c]",
            y="force of contact [rho c v A / 2]",
            legend={},
        )
        velocity = Panel(
            line(t, 1.0 - part, "--", **law, zorder=0),
            line(t, part, "--", **law, zorder=0),
            line(t, first, label="first bar"),
            line(t, second, "k:", label="second bar"),
            x="time since the contact [L / c]",
            y="mean velocity [v]",
            legend={},
        )
        title = f"{self.title}: {record.particles.count} particles, {self.dimension}D"
        return {"colliding-bars": Sheet([[force, velocity]], (9.0, 3.8), title)}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        record = records["bars"]
        first, second = self.mean_velocities(record).T
        return {
            "colliding-bars": {
                "time [s]": record.times,
                "force of contact [N]": record.history[_FORCE],
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
