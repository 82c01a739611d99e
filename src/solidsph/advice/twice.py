"""The same effect twice."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts


def twice(seen: SceneFacts) -> Iterator[Advice]:
    """Two of one kind with the same parameters act twice as much."""
    for (a, first), (b, other) in combinations(seen.simulation.effects.items(), 2):
        if first == other:
            yield Advice(
                found=f"{a!r} and {b!r} are the same effect with the same parameters",
                expected="each once",
                remedy="leave one out, or state where each acts",
            )
