"""Checks of the numbers of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from numbers import Integral, Real
from typing import Any

import attrs

from solidsph.scene.scene_data import OFF, SceneData, SleepScene, StaticsScene
from solidsph.scene.static_solver import SOLVERS

# No kernel is of use at such a cover, and its pairs would fill any memory.
MOST_COVER = 100.0


def check_numbers(scene: SceneData) -> Iterator[str]:
    """Yield problems of all numbers of a scene."""
    yield from _motion(scene)
    if scene.statics is not None:
        yield from _statics(scene.statics, scene)
    if scene.sleep is not None:
        yield from _sleep(scene.sleep, scene)


def _motion(scene: SceneData) -> Iterator[str]:
    for name, value, unit in (
        ("duration", scene.duration, "s"),
        ("cover", scene.cover, "particle spacings"),
        ("time_step_factor", scene.time_step_factor, "fractions of the critical step"),
        ("time_step", scene.time_step, "s"),
    ):
        if value is not None and not (_is_number(value) and isfinite(value) and value > 0.0):
            yield f"{name} must be positive and finite, got {value!r}; give it in {unit}"
    cover: Any = scene.cover
    if _is_number(cover) and isfinite(cover) and cover > MOST_COVER:
        yield (
            f"cover must not exceed {MOST_COVER:g}, got {cover:.6g}; it is in particle "
            "spacings, usually 3"
        )
    factor: Any = scene.time_step_factor
    if _is_number(factor) and factor > 1.0:
        yield f"time_step_factor must not exceed 1, got {factor}; 0.6 is usual"
    outputs: Any = scene.outputs
    if isinstance(outputs, bool) or not isinstance(outputs, Integral):
        yield f"outputs must be a whole number, got {outputs!r}; it is how many states to record"
    elif outputs < 1:
        yield f"outputs must be at least 1, got {outputs}; the last state is always recorded"
    tolerance: Any = scene.energy_tolerance
    if tolerance != OFF and not (_is_number(tolerance) and isfinite(tolerance) and tolerance > 0.0):
        yield (
            f"energy_tolerance must be a positive number or {OFF!r}, got {tolerance!r}; it is the "
            "largest allowed energy residual over the energy in play, 0.01 by default"
        )


def _statics(wanted: StaticsScene, scene: SceneData) -> Iterator[str]:
    for name in ("load_steps", "max_iterations"):
        if getattr(wanted, name) is not None:
            yield from _whole_number(f"statics: {name}", getattr(wanted, name), 1)
    yield from _fraction("statics: tolerance", wanted.tolerance)
    if wanted.solver not in SOLVERS:
        known = ", ".join(map(repr, SOLVERS))
        yield f"statics: solver must be one of {known}, got {wanted.solver!r}"
    default = attrs.fields(SceneData).time_step_factor.default
    for name, given in (
        ("an integrator", scene.integrator is not None),
        ("a time step", scene.time_step is not None or scene.time_step_factor != default),
        ("an initial state", bool(scene.initial)),
    ):
        if given:
            yield (
                f"statics: {name} is given, but an equilibrium is not computed by stepping in "
                "time; leave it out, or leave out [statics]"
            )


def _sleep(wanted: SleepScene, scene: SceneData) -> Iterator[str]:
    if scene.statics is not None:
        yield "sleep: an equilibrium has no motion; leave out [sleep], or leave out [statics]"
    yield from _fraction("sleep: tolerance", wanted.tolerance)
    yield from _whole_number("sleep: slabs", wanted.slabs, 2)


def _fraction(name: str, value: Any) -> Iterator[str]:
    if not (_is_number(value) and 0.0 < value < 1.0):
        yield f"{name} must lie between 0 and 1, got {value!r}; the default is 1e-9"


def _whole_number(name: str, value: Any, least: int) -> Iterator[str]:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        yield f"{name} must be a whole number of at least {least}, got {value!r}"


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
