"""Two equal effects, which act twice as much as one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts


def twice(facts: SceneFacts) -> Iterator[Advice]:
    """Compare effects by kind and parameters."""
    for (a, first), (b, second) in combinations(facts.simulation.effects.items(), 2):
        if first == second:
            yield Advice(
                finding=f"{a!r} and {b!r} are the same effect with the same parameters",
                expected="each once",
                remedy="leave one out, or state where each acts",
            )
