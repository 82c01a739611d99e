"""Outputs so far apart that what vibrates is not seen between them."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_A_PERIOD = 8.0  # outputs


def coarse_outputs(seen: SceneFacts) -> Iterator[Advice]:
    """Of the slowest free vibration: quicker ones are seen less still."""
    if not seen.moves or seen.answering(Need.REST):
        return
    period, duration = seen.slowest_period, seen.scene.duration
    interval = duration / min(seen.scene.outputs, seen.simulation.steps)
    if interval <= period / _A_PERIOD or duration <= period or not _vibrates(seen, period):
        return
    yield Advice(
        found=f"an output every {interval:.2g} s, and the slowest free vibration has a period of "
        f"about {period:.2g} s",
        expected=f"{_A_PERIOD:g} outputs a period",
        remedy=f"outputs = {round(_A_PERIOD * duration / period)}",
    )


def _vibrates(seen: SceneFacts, period: float) -> bool:
    """Whether something comes quickly enough to set the slowest vibration off."""
    imposed = [one for one in (*seen.loads, *seen.motions) if one.peak > 0.0]
    quick = any(one.rise < period for one in imposed)
    held = all(one.supported for one in seen.bodies)
    return held and (quick or bool(seen.velocities.any()) or bool(seen.displacements.any()))
