"""A ball, here a disc, that falls on the corner of a block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, degrees, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import vanishing
from solidsph_cases._energy import residual_over_start, smallest_volume_ratio

SIDE, RADIUS = 1.0, 0.3  # of the block and the ball [m]
DENSITY = 1000.0  # [kg/m^3]

# Sums over a thousand particles.
_ROUNDING = 1e-9


@final
@attrs.frozen
class BallOnCorner(Case):
    """It comes along the diagonal of the block, strikes the corner, and goes back as it came.

    The corner of a block is a singular place: it is pressed the more, the finer the spacing. The
    ball returns along the diagonal by symmetry, as far as few particles touch it evenly, and with
    the momentum that the block does not take.
    """

    title = "A ball on a corner"
    source = "symmetry; conservation of momentum and energy"
    sweep = {"across": (8, 12, 16)}
    trials = {
        "at a tenth of the wave speed": Trial(brief={"duration": 0.1}),
        "at a quarter of the wave speed": Trial({"speed": 9.0}),
    }

    speed: float = number(default=3.6)  # of the ball [m/s]
    across: int = 12  # spacings along the ball's diameter
    duration: float = number(default=0.15)  # [s]
    aside: float = number(default=10.0)  # angle off the diagonal that passes [degrees]

    def scenes(self) -> Mapping[str, Scene]:
        spacing = 2.0 * RADIUS / self.across
        away = RADIUS / sqrt(2.0) + 0.2 * spacing
        along = -self.speed / sqrt(2.0)
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "block",
                shape={"type": "box", "lengths": [SIDE, SIDE], "origin": [-SIDE, -SIDE]},
                spacing=spacing,
            )
            .body(
                "ball",
                shape={"type": "disc", "radius": RADIUS, "centre": [away, away]},
                spacing=spacing,
            )
            .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=DENSITY)
            .initial(where="ball", velocity={"x": along, "y": along})
            .effect("contact")
            .duration(self.duration)
            .outputs(60)
        )
        return {"fall": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["fall"]
        masses = DENSITY * record.particles.volumes
        momentum = np.einsum("n,tni->ti", masses, record.field("velocity")[:])
        lost = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
        ball = record.particles.tagged("ball")
        x, y = record.field("velocity")[-1][ball].T @ masses[ball]
        angle = degrees(atan2(y, x)) - 45.0
        quantity = "direction in which the ball returns, off the diagonal"
        return [
            vanishing(
                record,
                "change of the momentum over that at the start",
                float(lost),
                _ROUNDING,
                self.source,
            ),
            residual_over_start(record),
            vanishing(record, quantity, angle, self.aside, self.source, unit="degrees"),
            smallest_volume_ratio(record),
        ]
