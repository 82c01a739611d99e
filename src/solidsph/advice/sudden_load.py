"""A load or a velocity so sudden that its front is steeper than the particles resolve."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need

# Waves across a spacing in which a load should rise.
_CELLS = 4.0


def sudden_load(facts: SceneFacts) -> Iterator[Advice]:
    """Compare rise times with the time of a wave across a spacing."""
    if not facts.is_motion or not facts.lacks(Need.SHOCKS):
        return
    time = facts.cell_time
    remedy = (
        f"let it rise over {2.0 * _CELLS * time:.2g} s or more, or add [[effect]] "
        "'artificial-viscosity'"
    )
    for load in facts.loads:
        if load.on_surface and load.peak > 0.0 and load.rise < _CELLS * time:
            when = "at once" if load.rise == 0.0 else f"within {load.rise:.2g} s"
            yield Advice(
                finding=f"{load.label!r} loads a surface with {load.stresses.max():.3g} Pa {when}, "
                f"and a wave takes {time:.2g} s across a spacing: behind its front the stress "
                "will ring",
                expected=f"a rise over {_CELLS:g} such times",
                remedy=remedy,
            )
    if facts.velocity_jump > 0.0:
        moving = [repr(motion.label) for motion in facts.motions if motion.speeds[0] > 0.0]
        what = f"{', '.join(moving)} starts" if moving else "the initial state moves"
        yield Advice(
            finding=f"{what} beside neighbours that do not, {100 * facts.velocity_jump:.2g} % of "
            "the wave speed apart: a shock",
            expected=f"a velocity that begins over {_CELLS * time:.2g} s, or that is smooth",
            remedy=remedy,
        )
