"""Hourglass control in one dimension, where the gradient sees all motions."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need


def hourglass_unneeded(facts: SceneFacts) -> Iterator[Advice]:
    """Find control in a bar, which has no bending: it only stiffens the shortest waves."""
    if facts.dimension > 1:
        return
    for label in facts.effects_for(Need.UNSEEN_MOTIONS):
        yield Advice(
            finding=f"{label!r} is for motions of two and three dimensions, and this is a bar",
            expected="no control in one dimension: it changes only the shortest waves",
            remedy="leave the effect out",
        )
