"""A viscosity for shocks in a motion that has none."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

# Waves across a spacing in which a load rises smoothly; a slow motion over the wave speed.
_CELLS, _SLOW = 20.0, 0.02


def viscosity_unneeded(seen: SceneFacts) -> Iterator[Advice]:
    """Smooth and slow: no force, imposed motion or initial velocity has a front."""
    viscous = seen.answering(Need.SHOCKS)
    if not viscous or len(seen.bodies) > 1:
        return
    if seen.moves and (_sudden(seen) or seen.vigour > _SLOW or seen.velocity_jump > 0.0):
        return
    found = (
        f"no load, imposed motion or velocity comes within {_CELLS * seen.cell_time:.2g} s, "
        f"{_CELLS:g} waves across a spacing"
        if seen.moves
        else "nothing moves in an equilibrium"
    )
    for label in viscous:
        yield Advice(
            found=f"{label!r} is for shocks, and there are none: {found}",
            expected="no viscosity: it damps what is smooth, and costs time",
            remedy="leave the effect out",
        )


def _sudden(seen: SceneFacts) -> bool:
    slow = _CELLS * seen.cell_time
    return any(one.on_surface and one.peak > 0.0 and one.rise < slow for one in seen.loads) or any(
        one.jump > 1e-4 * seen.first.speed for one in seen.motions
    )
