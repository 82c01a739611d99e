"""Viscosity for shocks in a motion that has none."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

# Waves across a spacing in which a load rises smoothly; a slow motion over the wave speed.
_CELLS, _SLOW = 20.0, 0.02


def viscosity_unneeded(facts: SceneFacts) -> Iterator[Advice]:
    """Check whether loads, prescribed motions and initial velocities are smooth and slow."""
    viscous = facts.effects_for(Need.SHOCKS)
    if not viscous or len(facts.bodies) > 1:
        return
    slow = _CELLS * facts.cell_time
    why = "nothing moves in an equilibrium"
    if facts.is_motion:
        why = (
            f"no load, prescribed motion or velocity comes within {slow:.2g} s, {_CELLS:g} waves "
            "across a spacing"
        )
        loads = [load for load in facts.loads if load.on_surface and load.peak > 0.0]
        if (
            any(load.rise < slow for load in loads)
            or any(motion.speeds[0] > 1e-4 * facts.fastest.speed for motion in facts.motions)
            or facts.vigour > _SLOW
            or facts.velocity_jump > 0.0
        ):
            return
    for label in viscous:
        yield Advice(
            finding=f"{label!r} is for shocks, and there are none: {why}",
            expected="no viscosity: it damps what is smooth, and costs time",
            remedy="leave the effect out",
        )
