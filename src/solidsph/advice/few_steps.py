"""A duration of hardly any steps."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

_FEW = 10


def few_steps(seen: SceneFacts) -> Iterator[Advice]:
    """A wave crosses about half a spacing a step."""
    if not seen.moves or seen.simulation.steps >= _FEW:
        return
    longest = max(one.transit for one in seen.bodies)
    yield Advice(
        found=f"the duration of {seen.scene.duration:.3g} s is {seen.simulation.steps} steps of "
        f"{seen.simulation.step_size:.2g} s",
        expected=f"as long as a wave needs through the body, {longest:.2g} s, or longer",
        remedy="a longer duration, or check the units of modulus and density",
    )
