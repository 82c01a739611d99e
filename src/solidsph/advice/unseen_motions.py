"""Gradients of high degree do not see some motions, which grow if nothing controls them."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

# Velocity over wave speed, or strain, beyond which a motion is violent: a beam that swings by a
# fifth of its length under its weight stays whole without control.
_VIOLENT = 0.05


def unseen_motions(facts: SceneFacts) -> Iterator[Advice]:
    """Check the largest velocity; docs/hourglass.md measures such motions in a column."""
    if facts.dimension == 1 or not facts.is_motion or not facts.lacks(Need.UNSEEN_MOTIONS):
        return
    # With sums that are right at the surface such motions stay as small as with control: a column
    # thrown to the side ends without a trace of them.
    if facts.fits_surface:
        return
    degree = max(body.exact_degree for body in facts.bodies)
    if degree >= 2 and facts.vigour > _VIOLENT:
        yield Advice(
            finding=f"a gradient exact for polynomials of degree {degree}, and nothing against "
            f"motions that it does not see, at {100 * facts.vigour:.2g} % of the wave speed",
            expected=f"control of them beyond {100 * _VIOLENT:g} %",
            remedy="add [[effect]] 'hourglass-control'",
        )
