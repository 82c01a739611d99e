"""A slab on a layer a thousand times softer, joined where they touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import final

import attrs
import numpy as np
from scipy.optimize import brentq

from solidsph.maths.arrays import Array
from solidsph.registry.construct import describe
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import compared, finished
from solidsph_cases._energy import residual_over_start, smallest_volume_ratio
from solidsph_cases._scene import SOFT, box, check_all_positive, check_count
from solidsph_cases.drawing.sheet import Panel, Sheet, line, mark

LENGTH = 0.5  # of both the layer and the slab [m]

# Up to this part of the layer's wave speed the slab swings as the linear theory says.
_SMALL = 0.02
_PERIODS, _OUTPUTS = 1.3, 260

# A spring that has given way to so much is no joint any more.
_JOINED = 1.5


@final
@attrs.frozen
class StiffnessJump(Case):
    """Between frictionless walls the slab swings on the layer, whose other side is held.

    Waves of the stiff slab are far shorter than those of the layer, the time step is theirs, and
    the joint has to pass on the stress between. With M and m the masses of slab and layer, and the
    slab rigid beside it, the lowest frequency is w = x c / L with x tan x = m / M, c being the
    confined wave speed of the layer; the slab's own compliance, 1 / ratio of the layer's, is
    below the tolerance from a ratio of 100 on.
    """

    title = "A stiff slab swings on a soft layer"
    source = "Timoshenko: a rod with a mass at its end"
    sweep = {"along": (10, 20, 40)}
    trials = {
        "1:1000": Trial({}, {"along": 8, "across": 4, "tolerance": 0.06}),
        "1:1000, thrown hard": Trial({"speed": 0.3}, {"along": 8, "across": 4, "tolerance": 0.06}),
    }

    ratio: float = number(default=1000.0)  # of the moduli [-]
    along: int = 20  # particles along each
    across: int = 8  # and across
    speed: float = number(default=0.01)  # of the slab, over the layer's wave speed [-]
    tolerance: float = number(default=0.03)  # largest error of the period that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("stiffness-jump", "along", self.along, 4)
        check_count("stiffness-jump", "across", self.across, 4)
        units = dict.fromkeys(("ratio", "speed", "tolerance"), "parts of one")
        check_all_positive("stiffness-jump", self, **units)

    @property
    def period(self) -> float:
        """Of the linear theory [s]"""
        x = brentq(lambda x: x * np.tan(x) - 1.0, 0.1, 1.5)
        return float(2.0 * np.pi * LENGTH / (x * SOFT.wave_speed))

    def scenes(self) -> Mapping[str, Scene]:
        builder = Simulation.builder().title(self.title)
        spacing = LENGTH / (self.along - 1)
        for name, start, stiffness in (("layer", 0.0, 1.0), ("slab", LENGTH, self.ratio)):
            material = attrs.evolve(SOFT, youngs_modulus=stiffness * SOFT.youngs_modulus)
            builder = builder.body(
                name,
                shape=box(LENGTH, (self.across - 1) * spacing, origin=[start, 0.0]),
                spacing=spacing,
                material=describe("materials", material),
            )
        builder = (
            builder.boundary("clamp", where="all", axes=["y"])
            .boundary("clamp", where=f"X < {0.1 * spacing!r}", axes=["x"])
            .effect("joint")
            .initial(where="slab", velocity={"x": self.speed * SOFT.wave_speed})
            .duration(_PERIODS * self.period)
            .outputs(_OUTPUTS)
        )
        return {"slab": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["slab"]
        stretch = float(record.history["joint largest stretch [-]"].max())
        whole = finished(record) and stretch < _JOINED
        period = self.period if self.speed <= _SMALL else None
        found = self.swing_period(record)
        return [
            compared(record, "period", found, "s", period, self.source, self.tolerance),
            smallest_volume_ratio(record),
            Measurement(
                "largest stretch of the joint",
                stretch,
                "1",
                source="what is joined stays together",
                verdict="joined" if whole else "parted, or ended early",
                passed=whole,
            ),
            residual_over_start(record),
        ]

    def swing(self, record: Record) -> Array:
        """Mean displacement of the slab along the axis, (t,) [m]."""
        slab = record.particles.bodies["slab"]
        return np.asarray(
            (record.positions[:][:, slab, 0] - record.particles.positions[slab, 0]).mean(axis=1)
        )

    def swing_period(self, record: Record) -> float:
        """Twice the time between the first two passages of the rest position [s]."""
        u = self.swing(record)
        falls = np.flatnonzero((u[:-1] > 0.0) & (u[1:] <= 0.0))
        rises = np.flatnonzero((u[:-1] < 0.0) & (u[1:] >= 0.0))
        if not (falls.size and rises.size):
            return nan
        times = [
            record.times[k] + (record.times[k + 1] - record.times[k]) * u[k] / (u[k] - u[k + 1])
            for k in (int(falls[0]), int(rises[-1]))
        ]
        return float(2.0 * abs(times[1] - times[0]))

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The slab's displacement against time, and the stress along the axis at its farthest."""
        record = records["slab"]
        u, t = self.swing(record) / LENGTH, record.times / self.period
        swing = np.abs(u).max() * np.sin(2.0 * np.pi * t)
        label = "a rod with a mass, same amplitude"
        motion = Panel(
            line(t, u, label="simulated"),
            line(t, swing, "--", color="tab:orange", label=label),
            mark("margins", y=0.25),
            x="time [periods of the linear theory]",
            y="displacement of the slab [layers]",
            legend={"loc": "upper center"},
        )
        X = record.particles.positions[:, 0]
        sigma = record.field("cauchy_stress")[int(np.argmax(u))][:, 0, 0]
        sigma = sigma / (SOFT.density * SOFT.wave_speed**2)
        layer = X < LENGTH
        stress = Panel(
            line(X[layer], sigma[layer], "k.", markersize=4, label="layer"),
            line(X[~layer], sigma[~layer], "x", color="tab:blue", label="slab"),
            mark("axvline", LENGTH, color="0.6", linewidth=0.8),
            x="X [m]",
            y="Cauchy stress [moduli of the layer]",
            legend={},
        )
        count = record.particles.count
        title = f"{self.title}: moduli 1:{self.ratio:g}, {count} particles"
        return {"stiffness-jump": Sheet([[motion, stress]], (10.0, 3.8), title)}
