"""Gradients of high degree leave motions that they do not see, and that grow."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

# Velocity over wave speed, or strain, beyond which a motion is a violent one: a beam that swings by
# a fifth of its length under its weight stays whole without control.
_VIOLENT = 0.05


def unseen_motions(seen: SceneFacts) -> Iterator[Advice]:
    """The measured ones of docs/hourglass.md: some spacings high in a column thrown to the side."""
    if seen.dimension == 1 or not seen.moves or not seen.lacks(Need.UNSEEN_MOTIONS):
        return
    degree = max(one.body.formulation.gradient.exact_degree for one in seen.bodies)
    if degree >= 2 and seen.vigour > _VIOLENT:
        yield Advice(
            found=f"a gradient exact for polynomials of degree {degree}, and nothing against the "
            f"motions that it does not see, in a motion at {100 * seen.vigour:.2g} % of the wave "
            "speed",
            expected=f"control of them beyond {100 * _VIOLENT:g} %",
            remedy="add [[effect]] 'hourglass-control'",
        )
