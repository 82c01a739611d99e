"""A block with a hole, pressed together until the hole is closed."""

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
from solidsph_cases._compare import finished
from solidsph_cases._energy import residual_over_work, smallest_volume_ratio

SIDE, RADIUS = 1.0, 0.2  # of the block and its hole [m]


@final
@attrs.frozen
class ClosingHole(Case):
    """The hole flattens, its roof comes down on its floor, and contact holds both apart.

    Its ends are pressed beyond Biot's stretch of 0.54 before, and crease there: that is the
    rubber's own. Where the roof lies on the floor, they must not pass through each other.
    """

    title = "A hole that closes"
    source = "matter does not pass through itself"
    sweep = {"across": (16, 20, 28)}
    trials = {"to 0.6 of the height": Trial(brief={"across": 16, "duration": 0.6})}

    stroke: float = number(default=0.4)  # of the upper side at the end, over the height [-]
    across: int = 20  # spacings along a side
    duration: float = number(default=1.0)  # [s]
    deepest: float = number(default=0.5)  # that the roof may come into the floor [spacings]

    def scenes(self) -> Mapping[str, Scene]:
        press = f"-{0.5 * self.stroke * SIDE!r}*(1 - cos({pi / self.duration!r}*t))"
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={
                    "type": "difference",
                    "of": {"type": "box", "lengths": [SIDE, SIDE]},
                    "minus": {"type": "disc", "radius": RADIUS, "centre": [0.5 * SIDE] * 2},
                },
                spacing=SIDE / self.across,
                tags={"middle": f"abs(X - {0.5 * SIDE!r}) < {0.3 * RADIUS!r}"},
            )
            .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
            .boundary("clamp", where="bottom")
            .boundary(
                "prescribed-motion", where="top", displacement={"x": 0.0, "y": press}, label="press"
            )
            .effect("contact", itself=["block"])
            .duration(self.duration)
            .outputs(60)
        )
        return {"block": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["block"]
        gap = self.gap(record)
        open_at, least = float(gap[0]), float(gap.min())
        closes = least < 0.1 * open_at
        passed = finished(record) and closes and least > -self.deepest
        return [
            smallest_volume_ratio(record),
            residual_over_work(record, "block"),
            Measurement(
                "least height of the hole in its middle",
                least,
                "spacings",
                source=self.source,
                verdict="closed" if passed else "open still, or its roof is in its floor",
                passed=passed,
            ),
        ]

    def gap(self, record: Record) -> Array:
        """Least height of the roof above the floor of the hole in its middle, (t,) [spacings]."""
        X, y = record.particles.positions, record.positions[:][:, :, 1]
        middle = record.particles.tagged("middle")
        rim = middle[np.hypot(*(X[middle] - 0.5 * SIDE).T) < RADIUS + 0.1 * SIDE / self.across]
        above = X[rim, 1] > 0.5 * SIDE
        apart = y[:, rim[above]].min(axis=1) - y[:, rim[~above]].max(axis=1)
        return np.asarray(apart * self.across / SIDE)
