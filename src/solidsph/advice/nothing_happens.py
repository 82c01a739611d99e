"""A scene at rest that nothing moves."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts


def nothing_happens(facts: SceneFacts) -> Iterator[Advice]:
    """Check loads, prescribed motions and the initial state."""
    if facts.imposed or not facts.starts_at_rest:
        return
    loads = ", ".join(repr(load.label) for load in facts.loads)
    yield Advice(
        finding="nothing acts: no initial state, no prescribed motion, "
        + (f"and no force by {loads}" if loads else "and no load"),
        expected="something that moves the bodies",
        remedy="add a load, [[initial]] or 'prescribed-motion'; a load must not be 0",
    )
