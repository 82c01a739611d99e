"""Outputs so far apart that vibrations between them are not seen."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_PER_PERIOD = 8.0  # outputs


def coarse_outputs(facts: SceneFacts) -> Iterator[Advice]:
    """Compare outputs with the slowest free vibration, if something excites it."""
    if not facts.is_motion or facts.effects_for(Need.REST):
        return
    period, duration = facts.slowest_period, facts.scene.duration
    interval = duration / min(facts.scene.outputs, facts.simulation.steps)
    if interval <= period / _PER_PERIOD or duration <= period:
        return
    is_excited = not facts.starts_at_rest or any(h.rise < period for h in facts.imposed)
    if is_excited and all(body.is_held for body in facts.bodies):
        yield Advice(
            finding=f"an output every {interval:.2g} s, and the slowest free vibration has a "
            f"period of about {period:.2g} s",
            expected=f"{_PER_PERIOD:g} outputs a period",
            remedy=f"outputs = {round(_PER_PERIOD * duration / period)}",
        )
