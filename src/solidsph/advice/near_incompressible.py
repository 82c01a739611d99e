"""A material that hardly changes its volume, with gradients that do not see all motions."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_NEARLY = 0.49  # Poisson's ratio [-]
_TOO_NEARLY = 0.4999


def near_incompressible(seen: SceneFacts) -> Iterator[Advice]:
    """Pressures oscillate, or the body locks; and steps are as small as the wave is fast."""
    if seen.dimension == 1:
        return
    for one in seen.bodies:
        nu = one.poissons_ratio
        _, mu = one.body.material.lame_parameters
        ratio = one.speed / sqrt(mu / one.density)
        if nu > _TOO_NEARLY and seen.moves:
            yield Advice(
                found=f"body {one.name!r} has Poisson's ratio {nu:.6g}: its confined wave is "
                f"{ratio:.3g} times as fast as its shear wave, and the step that much smaller",
                expected="0.49 to 0.499 for rubber in motion",
                remedy="lower poissons_ratio, or make sure that the last digits matter",
            )
        elif (
            nu >= _NEARLY
            and one.body.formulation.gradient.exact_degree <= 1
            and seen.lacks(Need.UNSEEN_MOTIONS)
        ):
            yield Advice(
                found=f"body {one.name!r} has Poisson's ratio {nu:.4g}, with a linear gradient and "
                "nothing against motions that it does not see",
                expected=f"below {_NEARLY:g}, or a control of such motions",
                remedy="add [[effect]] 'hourglass-control', best with gradient = 'quadratic'",
            )
