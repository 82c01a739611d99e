"""A step far smaller than waves ask for: the weights of a gradient are large."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.run.safe_step import stable_step_of
from solidsph.scene.default_cover import kernel_cover

# Of the time of a wave across a spacing. The gradients that suit a body leave 0.2 and more, graded
# and jittered particles 0.05.
_SMALL = 0.02


def small_step(facts: SceneFacts) -> Iterator[Advice]:
    """Compare the critical step with the time of a wave across a spacing."""
    simulation, scene = facts.simulation, facts.scene
    if not facts.is_motion or scene.time_step is not None:
        return
    step, wanted = simulation.step_size / scene.time_step_factor, facts.cell_time
    by_effects = stable_step_of(0.0, simulation.integrator, simulation.dynamics.loads)
    if step >= _SMALL * wanted or by_effects < 2.0 * step:
        return
    best = kernel_cover(simulation.model.bodies[0].smoothing.kernel)
    larger = f"cover = {best:g} gives each particle more; else " if facts.cover < best else ""
    yield Advice(
        finding=f"the critical step of {step:.2g} s is {step / wanted:.2g} of the time of a wave "
        f"across a spacing: the run takes {simulation.steps} steps",
        expected=f"{_SMALL:g} or more: with too few neighbours a gradient is a small difference of "
        "large weights",
        remedy=f"{larger}gradient = 'corrected', or particles that stand more evenly",
    )
