"""Time step of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TypeVar

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load
from solidsph.run.built_scene import BuiltScene
from solidsph.run.cfl_step import cfl_step
from solidsph.run.safe_step import safe_step
from solidsph.scene.scene_data import MOST_STEPS, SceneData

S = TypeVar("S", bound=BuiltScene)

# Rounding must not add a step.
_WHOLE = 1.0 - 1e-12


def expected_steps(
    scene: SceneData, integrator: Integrator, loads: Sequence[Load], bodies: Sequence[Body]
) -> int:
    """Number of steps of a run, by the CFL step: as well as can be told without its forces.

    Raises:
        SceneError: the run would take too many steps.
    """
    largest = cfl_step(integrator, loads, bodies)
    return _count(scene, scene.time_step or scene.time_step_factor * largest)


def with_its_step(built: S) -> S:
    """A scene that was built with the CFL step, with the step of its own.

    That is a factor of the critical step as bounded from the spectrum of the scene, or of the CFL
    step where that is smaller: beyond it waves would cross more than a spacing in a step.

    Raises:
        SceneError: the given step exceeds the critical one, or the run would take too many steps.
    """
    scene, dynamics = built.scene, built.dynamics
    if scene.statics is not None:
        return built
    largest = cfl_step(built.integrator, dynamics.loads, built.model.bodies)
    safe = safe_step(dynamics, built.integrator, built.initial)
    critical, which = largest, "CFL step by confined wave speed and spacing"
    if safe is not None:
        critical, which = safe.step, "critical step by the scene's highest frequency"
    if scene.time_step is not None and scene.time_step > critical:
        raise SceneError(
            f"time_step = {scene.time_step:.6g} s exceeds the {which}, {critical:.6g} s; use a "
            "smaller one, or give time_step_factor instead"
        )
    step = scene.time_step or scene.time_step_factor * min(largest, critical)
    steps = _count(scene, step)
    dynamics = attrs.evolve(dynamics, step_size=scene.duration / steps)
    return attrs.evolve(built, dynamics=dynamics, steps=steps, safe=safe)


def _count(scene: SceneData, step: float) -> int:
    """Whole number of steps no longer than `step` [s]."""
    steps = scene.duration / step if step > 0.0 else float("inf")
    if not steps <= MOST_STEPS:
        raise SceneError(
            f"a duration of {scene.duration:.6g} s in steps of {step:.6g} s takes {steps:.3g} "
            f"steps, but at most {MOST_STEPS:.0e} are allowed; shorten the duration, or check the "
            "units of modulus, density and spacing"
        )
    return max(1, ceil(steps * _WHOLE))
