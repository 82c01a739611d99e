"""A block on an incline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, radians, sin
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_cases._compare import compared, finished, vanishing
from solidsph_cases._energy import residual_over_work
from solidsph_cases._scene import SOFT, box, check_all_positive, check_count, solid
from solidsph_cases.drawing.sheet import Panel, Sheet, line, mark

LENGTH, HEIGHT = 0.2, 0.1  # [m]
GRAVITY = 9.81  # [m/s^2]

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

    title = "A block on an incline"
    source = _SOURCE
    sweep = {"along": (8, 12, 16)}
    trials = {"slides, and sticks": Trial({}, {"along": 12, "duration": 0.2})}

    friction: float = number(default=0.3)  # f [-]
    steep: float = number(default=30.0)  # angle at which it slides [degrees]
    flat: float = number(default=16.0)  # and at which it stays [degrees]
    along: int = 12  # particles along the block
    duration: float = number(default=0.4)  # [s]
    ramp: float = number(default=0.1)  # until gravity is whole [s]

    def __attrs_post_init__(self) -> None:
        check_count("sliding-block", "along", self.along, 6)
        units = {"duration": "s", "ramp": "s", "steep": "degrees", "flat": "degrees"}
        check_all_positive("sliding-block", self, **units)

    def scenes(self) -> Mapping[str, Scene]:
        return {"slides": self._scene(self.steep), "sticks": self._scene(self.flat)}

    def _scene(self, degrees: float) -> Scene:
        angle, grows = radians(degrees), f"min(t/{self.ramp!r}, 1)"
        weight = {
            "x": f"{GRAVITY * sin(angle)!r}*{grows}",
            "y": f"-{GRAVITY * cos(angle)!r}*{grows}",
        }
        title = f"{self.title} of {degrees:g} degrees"
        shape, spacing = box(LENGTH, HEIGHT), LENGTH / self.along
        return (
            solid(title, "block", shape, spacing, SOFT)
            .effect("body-force", acceleration=weight, label="gravity")
            .effect(
                "rigid-wall",
                point={"y": 0.0},
                normal={"y": 1.0},
                friction=self.friction,
                label="incline",
            )
            .duration(self.duration)
            .outputs(_OUTPUTS)
            .scene()
        )

    def moved(self, times: Array) -> Array:
        """Way under an acceleration of 1 m/s^2 that grows as gravity does, (t,) [m]."""
        T = self.ramp
        after = np.maximum(times - T, 0.0)
        return np.asarray(np.minimum(times, T) ** 3 / (6.0 * T) + 0.5 * T * after + 0.5 * after**2)

    def acceleration(self, degrees: float) -> float:
        """Of a block that slides at that angle [m/s^2]."""
        angle = radians(degrees)
        return GRAVITY * (sin(angle) - self.friction * cos(angle))

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        slides, sticks = records["slides"], records["sticks"]
        way = self.way(slides)
        # The least squares of the whole way.
        shape = self.moved(slides.times)
        found = float(way @ shape / (shape @ shape))
        free = GRAVITY * sin(radians(self.flat)) * float(self.moved(sticks.times)[-1])
        moved = float(np.abs(self.way(sticks)).max()) / free
        # What friction has taken and its springs do not hold.
        held = slides.history["incline energy [J]"]
        heat = np.asarray(-slides.history["work of incline [J]"] - (held - held[0]))[-1]
        normal = SOFT.density * LENGTH * HEIGHT * GRAVITY * cos(radians(self.steep))
        grown = np.minimum(slides.times / self.ramp, 1.0)
        rubbed = float(np.sum(0.5 * (grown[1:] + grown[:-1]) * np.diff(way)))
        angle = float(np.degrees(np.arctan(self.friction)))
        return [
            compared(
                slides,
                f"acceleration at {self.steep:g} degrees",
                *(found, "m/s^2", self.acceleration(self.steep), _SOURCE, _TOLERANCE),
            ),
            Measurement(
                "heat of friction over friction times the way",
                heat / (self.friction * normal * rubbed),
                "1",
                verdict="the rest makes the block tremble: nothing damps it",
                passed=finished(slides),
            ),
            vanishing(
                sticks,
                f"largest way at {self.flat:g} degrees over that without friction",
                moved,
                _STAYS,
                f"the angle of friction is {angle:.3g} degrees",
                verdict="stays" if moved <= _STAYS else "slides",
            ),
            residual_over_work(slides, "sliding"),
            residual_over_work(sticks, "sticking"),
        ]

    def way(self, record: Record) -> Array:
        """Of the centre of mass down the incline, (t,) [m]."""
        V = record.particles.volumes
        x = record.positions[:][:, :, 0] @ V / V.sum()
        return np.asarray(x - x[0])

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The ways of both blocks, and the one that slides at its start and end."""
        slides, sticks = records["slides"], records["sticks"]
        t = slides.times
        law = self.acceleration(self.steep) * self.moved(t)
        ways = Panel(
            line(t, self.way(slides), label=f"{self.steep:g} degrees"),
            line(t, law, "--", color="tab:orange", label="Coulomb's law"),
            line(sticks.times, self.way(sticks), "k:", label=f"{self.flat:g} degrees"),
            x="t [s]",
            y="way down the incline [m]",
            legend={},
        )
        turn = np.radians(-self.steep)
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        ends = np.array([[-0.05, 0.0], [slides.positions[-1][:, 0].max() + 0.05, 0.0]])
        block = Panel(
            mark("plot", *(R @ slides.positions[0].T), "o", color="0.7", markersize=3.0),
            mark("plot", *(R @ slides.positions[-1].T), "o", color="black", markersize=3.0),
            mark("plot", *(R @ ends.T), "k-", linewidth=1.0),
            x="[m]",
            y="[m]",
            aspect="equal",
        )
        title = f"{self.title}: {slides.particles.count} particles, f = {self.friction:g}"
        return {"sliding-block": Sheet([[ways, block]], (11.0, 4.2), title)}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        return {
            f"block-{name}": {"time [s]": record.times, "way [m]": self.way(record)}
            for name, record in records.items()
        }
