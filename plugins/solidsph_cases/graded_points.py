"""A block of points that are dense on one side and coarse on the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio

LENGTH, HEIGHT = 1.0, 0.5  # [m]
MATERIAL = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)


@final
@attrs.frozen
class GradedPoints(Case):
    """Points of one's own, on the surface too, whose distances grow evenly from a corner.

    Between frictionless walls the block swings to and fro in its lowest standing wave, whose
    frequency pi c / length is known. The support is that of the coarsest spacing everywhere.
    """

    title = "A block of graded points"
    source = "standing wave of a confined bar: omega = pi c / length"
    sweep = {"along": (20, 30, 40)}
    studies = {"discretisation": "points of one's own are the subject"}
    trials = {"spacings from 1 to 4": Trial(brief={"along": 20})}

    grading: float = number(default=4.0)  # largest distance of points over the least [-]
    along: int = 30  # steps along the block
    speed: float = number(default=1e-3)  # largest at the start, over the wave speed [-]
    tolerance: float = number(default=0.01)  # largest error of the frequency that passes [-]

    def scenes(self) -> Mapping[str, Scene]:
        c = MATERIAL.wave_speed
        x, y = self.graded(LENGTH, self.along), self.graded(HEIGHT, self.along // 2)
        places = [[float(a), float(b)] for a in x for b in y]
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={"type": "box", "lengths": [LENGTH, HEIGHT]},
                spacing=float(np.diff(x).max()),
                discretisation={"type": "points", "positions": places},
            )
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .boundary("clamp", where="left or right", axes=["x"])
            .boundary("clamp", where="bottom or top", axes=["y"])
            .initial(velocity={"x": f"{self.speed * c!r}*sin({pi / LENGTH!r}*X)"})
            .duration(4.0 * LENGTH / c)
            .outputs(80)
        )
        return {"block": builder.scene()}

    def graded(self, length: float, count: int) -> Array:
        """Places (count + 1,) from 0 to a length [m], each step longer than that before."""
        share = np.linspace(0.0, 1.0, count + 1)
        return np.asarray(length * (self.grading**share - 1.0) / (self.grading - 1.0))

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        expected = pi * MATERIAL.wave_speed / LENGTH
        found = self.frequency(record)
        return [
            compared(record, "frequency", found, "rad/s", expected, self.source, self.tolerance),
            smallest_volume_ratio(record),
        ]

    def frequency(self, record: Record) -> float:
        """Of the standing wave, by the times at which it passes through zero [rad/s]."""
        X, volumes = record.particles.positions, record.particles.volumes
        wave = volumes * np.sin(pi / LENGTH * X[:, 0])
        way = (record.positions[:] - X)[:, :, 0] @ wave
        t = record.times
        passes = np.flatnonzero((way[1:-1] > 0.0) != (way[2:] > 0.0)) + 1
        zeros = t[passes] - way[passes] * np.diff(t)[passes] / np.diff(way)[passes]
        return float(pi * len(zeros) / zeros[-1]) if len(zeros) else 0.0
