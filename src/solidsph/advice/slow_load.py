"""A load so slow that nothing moves but what it moves: an equilibrium."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.interfaces.history import HistoryMaterial

# Slowest periods in which a load rises, and in which a damped motion has long come to rest.
_RISING, _RESTING = 20.0, 40.0


def slow_load(seen: SceneFacts) -> Iterator[Advice]:
    """By the slowest period of the bodies; not where materials remember, or waves are imposed."""
    if (
        not seen.moves
        or any(isinstance(b.material, HistoryMaterial) for b in seen.simulation.model.bodies)
        or not all(one.supported for one in seen.bodies)
        or seen.simulation.initial.velocities.any()
        or len(seen.bodies) > 1
    ):
        return
    imposed = [s for s in (*seen.loads, *seen.motions) if s.peak > 0.0]
    period, duration = seen.slowest_period, seen.scene.duration
    if not imposed:
        return
    remedy = "[statics] finds the equilibrium in a few load steps (statics, in place of integrator)"
    rise = min(one.rise for one in imposed)
    settled = max(one.settled for one in imposed)
    damped = bool(seen.answering(Need.REST))
    if isfinite(rise) and rise > _RISING * period:
        yield Advice(
            found=f"the quickest load takes {rise:.3g} s to rise, {rise / period:.3g} times the "
            f"slowest period, about {period:.2g} s",
            expected=f"less than {_RISING:g} periods, if something is to move",
            remedy=remedy,
        )
    elif damped and isfinite(settled) and duration - settled > _RESTING * period:
        yield Advice(
            found=f"after {settled:.2g} s nothing changes, and damping has "
            f"{(duration - settled) / period:.3g} of the slowest periods to bring it to rest",
            expected=f"less than {_RESTING:g} periods",
            remedy=remedy,
        )
