"""What tests of reports need: a sweep of which all is known, and hostile words."""

from __future__ import annotations

from math import inf
from typing import ClassVar

import attrs

from solidsph.scene.scene_data import InitialScene
from solidsph.studies.case import Case
from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point
from solidsph.studies.variant import with_settings
from solidsph_cases.csm1 import Csm1

HOSTILE = "</script><script>window.hit = 1</script><img src=x onerror='window.hit = 2'> & \"co\""

# Errors, wall times [s] and pair evaluations by scheme and by particles across, far enough from
# each other for every point to be clicked. The front by time is not that by pair evaluations.
ACROSS = (5, 9, 13)
SCHEMES = {
    "consistent": ((0.05, 0.1, 4e6), (0.012, 0.6, 3e7), (0.004, 3.0, 2e8)),
    "quadratic": ((0.08, 0.25, 1e6), (0.02, 1.5, 8e6), (0.007, 7.0, 6e7)),
}


def known() -> Frontier:
    """Six points that finished and one that did not."""
    points = [
        Point(
            {"across": across, "gradient": gradient},
            error,
            quantity="tip: u_x",
            value=-7.187 * (1.0 + error),
            reference=-7.187,
            spacing=0.02 / (across - 1),
            particles=18 * across * across,
            steps=10 * across,
            pair_evaluations=int(pairs),
            seconds=(time, 1.2 * time, 0.9 * time),
            peak_memory=int(2**20 * (150 + across)),
        )
        for gradient, row in SCHEMES.items()
        for across, (error, time, pairs) in zip(ACROSS, row, strict=True)
    ]
    failed = Point({"across": 17, "gradient": "consistent"}, inf, "diverged at step 120\nof 170")
    return Frontier([*points, failed], "across")


def hostile() -> Frontier:
    """The same, with words that a page must not take for its own."""
    points = [
        attrs.evolve(
            point,
            settings={**point.settings, "kernel": HOSTILE},
            quantity=HOSTILE,
            outcome=point.outcome if point.finished else HOSTILE,
        )
        for point in known().points
    ]
    return Frontier(points, "across")


@attrs.frozen
class OfFunctions(Case):
    """Its scene starts from a function, which no file can hold."""

    title: ClassVar[str] = "a case of functions"
    source: ClassVar[str] = "nowhere"

    across: int = 5
    gradient: str = "consistent"

    def scenes(self):
        words = {"gradient": self.gradient}
        (scene,) = with_settings(Csm1(across=self.across), words).scenes().values()
        start = InitialScene(displacement={"x": lambda x, y, z: 0.0 * x})
        return {"plain": scene, "moved": attrs.evolve(scene, initial=[start])}

    def measure(self, records):
        return []

    def draw(self, records, folder):
        return []
