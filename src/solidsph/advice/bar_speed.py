"""A bar in one dimension is in uniaxial strain: stiffer than a slender bar, with faster waves."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

_NOTABLE = 0.01  # difference of speeds [-]


def bar_speed(facts: SceneFacts) -> Iterator[Advice]:
    """Compare the confined wave speed with that of a slender bar."""
    if facts.dimension != 1:
        return
    for body in facts.bodies:
        slender = sqrt(body.youngs_modulus / body.density)
        if abs(body.speed / slender - 1.0) <= _NOTABLE:
            continue
        yield Advice(
            finding=f"body {body.name!r} is in one dimension, which is uniaxial strain: its waves "
            f"run at {body.speed:.5g} m/s",
            expected=f"sqrt(E / rho) = {slender:.5g} m/s, if a slender bar is meant",
            remedy="poissons_ratio = 0 for a slender bar; else silence this",
        )
