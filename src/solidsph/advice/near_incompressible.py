"""A material that hardly changes its volume: it needs small steps, or control of its pressures."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_NEARLY = 0.49  # Poisson's ratio [-]
_TOO_NEARLY = 0.4999


def near_incompressible(facts: SceneFacts) -> Iterator[Advice]:
    """Check Poisson's ratio: near 0.5 pressures oscillate, bodies lock, and waves are fast."""
    if facts.dimension == 1:
        return
    for body in facts.bodies:
        nu = body.poissons_ratio
        if nu > _TOO_NEARLY and facts.is_motion:
            _, mu = body.body.material.lame_parameters
            ratio = body.speed / sqrt(mu / body.density)
            yield Advice(
                finding=f"body {body.name!r} has Poisson's ratio {nu:.6g}: its confined wave is "
                f"{ratio:.3g} times as fast as its shear wave, and the step that much smaller",
                expected="0.49 to 0.499 for rubber in motion",
                remedy="lower poissons_ratio, or make sure that the last digits matter",
            )
        elif nu >= _NEARLY and body.exact_degree <= 1 and facts.lacks(Need.UNSEEN_MOTIONS):
            yield Advice(
                finding=f"body {body.name!r} has Poisson's ratio {nu:.4g}, with a linear gradient "
                "and nothing against motions that it does not see",
                expected=f"below {_NEARLY:g}, or a control of such motions",
                remedy="add [[effect]] 'hourglass-control', best with gradient = 'quadratic'",
            )
