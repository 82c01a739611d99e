"""A scene at rest that nothing moves."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts


def nothing_happens(seen: SceneFacts) -> Iterator[Advice]:
    """No force, no imposed motion, no initial state."""
    if any(one.peak > 0.0 for one in seen.loads) or any(one.peak > 0.0 for one in seen.motions):
        return
    if seen.velocities.any() or seen.displacements.any():
        return
    loads = ", ".join(repr(one.label) for one in seen.loads)
    yield Advice(
        found="nothing acts: no initial state, no motion imposed, "
        + (f"and no force by {loads}" if loads else "and no load"),
        expected="something that moves the bodies",
        remedy="add a load, [[initial]] or 'prescribed-motion'; a load must not be 0",
    )
