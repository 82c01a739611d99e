"""A duration of hardly any steps."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

_FEW = 10


def few_steps(facts: SceneFacts) -> Iterator[Advice]:
    """Count steps; a wave crosses about half a spacing in each."""
    if not facts.is_motion or facts.simulation.steps >= _FEW:
        return
    longest = max(body.transit for body in facts.bodies)
    yield Advice(
        finding=f"the duration of {facts.scene.duration:.3g} s is {facts.simulation.steps} steps "
        f"of {facts.simulation.step_size:.2g} s",
        expected=f"at least the time of a wave through the body, {longest:.2g} s",
        remedy="a longer duration, or check the units of modulus and density",
    )
