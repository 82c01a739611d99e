"""Damping so strong that a body creeps."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_STRONG = 5.0  # times critical
_LONG = 0.3  # of the duration


def overdamped(seen: SceneFacts) -> Iterator[Advice]:
    """Against the slowest free vibration, which damping at 2 omega brings to rest the soonest."""
    if not seen.moves:
        return
    omega = 2.0 * pi / seen.slowest_period
    for label, effect in seen.answering(Need.REST).items():
        rate = effect.damping_rate(seen.simulation.model.bodies)
        creeping = rate / omega**2
        if rate > _STRONG * 2.0 * omega and creeping > _LONG * seen.scene.duration:
            yield Advice(
                found=f"{label!r} damps at {rate:.3g}/s, {rate / (2.0 * omega):.3g} times what is "
                f"critical: the slowest motion takes {creeping:.2g} s to follow, of a duration of "
                f"{seen.scene.duration:.2g} s",
                expected=f"about 2 omega = {2.0 * omega:.2g}/s",
                remedy=f"rate = {2.0 * omega:.2g}, or [statics] if only the end matters",
            )
