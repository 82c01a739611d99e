"""Damping so strong that a body creeps through the whole duration."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

_STRONG = 5.0  # times critical
_LONG = 0.3  # of the duration


def overdamped(facts: SceneFacts) -> Iterator[Advice]:
    """Compare damping with the slowest vibration, which 2 omega brings to rest the soonest."""
    if not facts.is_motion:
        return
    omega = 2.0 * pi / facts.slowest_period
    for label in facts.effects_for(Need.REST):
        rate = facts.simulation.load_of(label).damping_rate
        creeping = rate / omega**2
        if rate > _STRONG * 2.0 * omega and creeping > _LONG * facts.scene.duration:
            yield Advice(
                finding=f"{label!r} damps at {rate:.3g}/s, {rate / (2.0 * omega):.3g} times the "
                f"critical rate: the slowest motion takes {creeping:.2g} s to follow, of a "
                f"duration of {facts.scene.duration:.2g} s",
                expected=f"about 2 omega = {2.0 * omega:.2g}/s",
                remedy=f"rate = {2.0 * omega:.2g}, or [statics] if only the end matters",
            )
