"""A control of motions that the gradient sees anyway."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need


def hourglass_unneeded(seen: SceneFacts) -> Iterator[Advice]:
    """Along a line there is no bending, and the control only stiffens the shortest waves."""
    if seen.dimension > 1:
        return
    for label in seen.answering(Need.UNSEEN_MOTIONS):
        yield Advice(
            found=f"{label!r} is for motions of two and three dimensions, and this is a bar",
            expected="no control in one dimension: it changes only the shortest waves",
            remedy="leave the effect out",
        )
