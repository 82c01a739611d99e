"""Time step of a scene."""

from __future__ import annotations

from collections.abc import Sequence

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load
from solidsph.run.stable_step import stable_step
from solidsph.scene.scene_data import MOST_STEPS, SceneData


def step_size(
    scene: SceneData, integrator: Integrator, loads: Sequence[Load], bodies: Sequence[Body]
) -> float:
    """Time step of the scene, given or as a factor of the CFL step [s].

    Raises:
        SceneError: the given step exceeds the CFL step, or the run would take too many steps.
    """
    largest = stable_step(integrator, loads, bodies)
    if scene.time_step is not None and scene.time_step > largest:
        raise SceneError(
            f"time_step = {scene.time_step:.6g} s exceeds the CFL step, {largest:.6g} s by "
            "confined wave speed and spacing; use a smaller one, or give time_step_factor instead"
        )
    step = scene.time_step or scene.time_step_factor * largest
    steps = scene.duration / step if step > 0.0 else float("inf")
    if not steps <= MOST_STEPS:
        raise SceneError(
            f"a duration of {scene.duration:.6g} s in steps of {step:.6g} s takes {steps:.3g} "
            f"steps, but at most {MOST_STEPS:.0e} are allowed; shorten the duration, or check the "
            "units of modulus, density and spacing"
        )
    return step
