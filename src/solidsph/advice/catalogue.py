"""All warnings, and those that a scene gets."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress

import attrs
import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.bar_speed import bar_speed
from solidsph.advice.bodies_meet import bodies_meet
from solidsph.advice.coarse_outputs import coarse_outputs
from solidsph.advice.deep_clamp import deep_clamp
from solidsph.advice.few_across import few_across
from solidsph.advice.few_steps import few_steps
from solidsph.advice.half_supports import half_supports
from solidsph.advice.hourglass_unneeded import hourglass_unneeded
from solidsph.advice.large_cover import large_cover
from solidsph.advice.near_incompressible import near_incompressible
from solidsph.advice.nothing_happens import nothing_happens
from solidsph.advice.overdamped import overdamped
from solidsph.advice.overloaded import overloaded
from solidsph.advice.pressed_at_start import pressed_at_start
from solidsph.advice.scene_facts import SceneFacts
from solidsph.advice.several_faces import several_faces
from solidsph.advice.slow_load import slow_load
from solidsph.advice.small_cover import small_cover
from solidsph.advice.sudden_load import sudden_load
from solidsph.advice.twice import twice
from solidsph.advice.unheld import unheld
from solidsph.advice.units import units
from solidsph.advice.unseen_motions import unseen_motions
from solidsph.advice.viscosity_unneeded import viscosity_unneeded
from solidsph.run.built_scene import BuiltScene

Check = Callable[[SceneFacts], Iterator[Advice]]

_CHECKS: tuple[Check, ...] = (
    nothing_happens,
    units,
    overloaded,
    unheld,
    several_faces,
    few_across,
    small_cover,
    large_cover,
    half_supports,
    near_incompressible,
    unseen_motions,
    bar_speed,
    sudden_load,
    slow_load,
    bodies_meet,
    pressed_at_start,
    deep_clamp,
    viscosity_unneeded,
    hourglass_unneeded,
    overdamped,
    twice,
    coarse_outputs,
    few_steps,
)

ADVICE: Mapping[str, Check] = {check.__name__.replace("_", "-"): check for check in _CHECKS}
"""Every warning by its name."""


def advise(simulation: BuiltScene) -> tuple[Advice, ...]:
    """All warnings about a built scene, except for those that it silences.

    A warning must never make a run fail: one whose check raises is left out.
    """
    facts, warnings = SceneFacts(simulation), []
    for name, check in ADVICE.items():
        if name in simulation.scene.silence:
            continue
        with suppress(Exception), np.errstate(all="ignore"):
            warnings += [attrs.evolve(advice, name=name) for advice in check(facts)]
    return tuple(warnings)


def unknown_names(silenced: Sequence[str]) -> Iterable[str]:
    """Problem and remedy for each silenced name that no warning has."""
    for name in silenced:
        if name not in ADVICE:
            near = difflib.get_close_matches(name, ADVICE, 1)
            hint = f"did you mean {near[0]!r}?" if near else "take it out"
            yield f"silence: no warning is called {name!r}; {hint} (known: {', '.join(ADVICE)})"
