"""A load so slow that the motion is an equilibrium at every moment."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.interfaces.history import HistoryMaterial

# Slowest periods in which a load rises, and in which a damped motion has long come to rest.
_RISING, _RESTING = 20.0, 40.0

_REMEDY = "[statics] finds the equilibrium in a few load steps (statics, in place of integrator)"


def slow_load(facts: SceneFacts) -> Iterator[Advice]:
    """Compare rises with the slowest period, without material history or initial velocity."""
    if (
        not facts.is_motion
        or any(isinstance(b.material, HistoryMaterial) for b in facts.simulation.model.bodies)
        or not all(body.is_held for body in facts.bodies)
        or facts.simulation.initial.velocities.any()
        or len(facts.bodies) > 1
        or not facts.imposed
    ):
        return
    period = facts.slowest_period
    rise = min(history.rise for history in facts.imposed)
    settled = max(history.settled for history in facts.imposed)
    resting = facts.scene.duration - settled
    if isfinite(rise) and rise > _RISING * period:
        yield Advice(
            finding=f"the quickest load takes {rise:.3g} s to rise, {rise / period:.3g} times the "
            f"slowest period, about {period:.2g} s",
            expected=f"less than {_RISING:g} periods, if something is to move",
            remedy=_REMEDY,
        )
    elif facts.effects_for(Need.REST) and isfinite(settled) and resting > _RESTING * period:
        yield Advice(
            finding=f"after {settled:.2g} s nothing changes, and damping has "
            f"{resting / period:.3g} of the slowest periods to bring it to rest",
            expected=f"less than {_RESTING:g} periods",
            remedy=_REMEDY,
        )
