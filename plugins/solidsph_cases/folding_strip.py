"""A strip that buckles, folds, and comes to lie on itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import finished
from solidsph_cases._energy import residual_over_work, smallest_volume_ratio

LENGTH, THICKNESS = 1.6, 0.1  # [m]


@final
@attrs.frozen
class FoldingStrip(Case):
    """Its ends come together, it rises between them, and both legs of the fold touch.

    Where it bends most, its inner side is pressed to half, which creases rubber.
    """

    title = "A strip that folds onto itself"
    source = "matter does not pass through itself"
    sweep = {"across": (3, 4, 5)}
    trials = {
        "folded flat": Trial(brief={"across": 3, "duration": 1.0}),
    }

    nearer: float = number(default=0.82)  # way of the ends towards each other, over the length [-]
    across: int = 4  # spacings through the thickness
    duration: float = number(default=1.5)  # [s]
    push: float = number(default=1.0)  # upwards [m/s^2]
    deepest: float = number(default=0.3)  # that one leg may come into the other [spacings]

    def scenes(self) -> Mapping[str, Scene]:
        way = f"{0.25 * self.nearer * LENGTH!r}*(1 - cos({pi / self.duration!r}*t))"
        box = {
            "type": "box",
            "lengths": [LENGTH, THICKNESS],
            "origin": [-0.5 * LENGTH, -0.5 * THICKNESS],
        }
        builder = (
            Simulation.builder()
            .title(self.title)
            .body("strip", shape=box, spacing=THICKNESS / self.across)
            .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
            .effect("body-force", acceleration={"y": self.push}, label="push")
            .effect("mass-damping", rate=2.0)
            .effect("contact", itself=["strip"])
            .duration(self.duration)
            .outputs(60)
        )
        for end, sign in (("left", ""), ("right", "-")):
            motion = {"x": sign + way, "y": 0.0}
            builder = builder.boundary("prescribed-motion", where=end, displacement=motion)
        return {"strip": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["strip"]
        least = float(self.between(record).min())
        touches = least < 1.0
        passed = finished(record) and touches and least > -self.deepest
        return [
            smallest_volume_ratio(record),
            residual_over_work(record, "strip"),
            Measurement(
                "least distance between the legs",
                least,
                "spacings",
                source=self.source,
                verdict="they touch" if passed else "they do not touch, or pass through each other",
                passed=passed,
            ),
        ]

    def between(self, record: Record) -> Array:
        """Least distance between the lower sides of both legs, (t,) [spacings].

        Negative where a particle of one lies between both sides of the other.
        """
        X = record.particles.positions
        row = np.argsort(X[:, 0], kind="stable")
        lower, upper = row[X[row, 1] < -0.49 * THICKNESS], row[X[row, 1] > 0.49 * THICKNESS]
        # The legs, without the bends at both ends of each.
        legs = [abs(X[lower, 0] - k * LENGTH) < 0.15 * LENGTH for k in (-0.25, 0.25)]
        spacing = THICKNESS / self.across
        apart = []
        for x in record.positions[:]:
            (below, through), (others, of_others) = (
                (x[lower[leg]], x[upper[leg]] - x[lower[leg]]) for leg in legs
            )
            one, two = _apart(below, others, of_others), _apart(others, below, through)
            apart.append(min(distance.min() for distance in (one, two)))
        return np.array(apart) / spacing


def _apart(points: Array, lower: Array, through: Array) -> Array:
    """Signed distance of `points` (m, 2) from a side `lower` (k, 2) of a strip, (m,) [m].

    `through` (k, 2) leads from it to the other side [m]: where the lower side is creased it is
    still smooth.
    """
    distance, nearest = cKDTree(lower).query(points)
    offset, along = points - lower[nearest], through[nearest]
    thickness = np.linalg.norm(along, axis=1)
    depth = np.sum(offset * along, axis=1) / thickness
    beside = np.sqrt(np.maximum(distance**2 - depth**2, 0.0))
    return np.where((depth > 0.0) & (beside < depth), -depth, distance)
