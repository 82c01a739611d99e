"""A bar in one dimension is in uniaxial strain, and its waves are those of a confined body."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

_NOTABLE = 0.01  # difference of speeds [-]


def bar_speed(seen: SceneFacts) -> Iterator[Advice]:
    """Whoever expects a slender bar finds it stiffer."""
    if seen.dimension != 1:
        return
    for one in seen.bodies:
        slender = sqrt(one.youngs_modulus / one.density)
        if abs(one.speed / slender - 1.0) <= _NOTABLE:
            continue
        yield Advice(
            found=f"body {one.name!r} is in one dimension, which is uniaxial strain: its waves run "
            f"at {one.speed:.5g} m/s",
            expected=f"sqrt(E / rho) = {slender:.5g} m/s, if a slender bar is meant",
            remedy="poissons_ratio = 0 for a slender bar; else silence this",
        )
