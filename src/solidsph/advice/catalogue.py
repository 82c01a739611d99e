"""All warnings, and what a scene does to hear them or not."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

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

Look = Callable[[SceneFacts], Iterator[Advice]]

_LOOKS: tuple[Look, ...] = (
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

ADVICE: Mapping[str, Look] = {look.__name__.replace("_", "-"): look for look in _LOOKS}
"""Every warning by its name."""


def advise(simulation: BuiltScene) -> tuple[Advice, ...]:
    """What there is to say about a built scene, less what it silences.

    To warn must never be why a run fails: a warning that cannot be formed is left out.
    """
    seen, heard = SceneFacts(simulation), []
    for name, look in ADVICE.items():
        if name in simulation.scene.silence:
            continue
        try:
            with np.errstate(all="ignore"):
                heard += [attrs.evolve(one, name=name) for one in look(seen)]
        except Exception:
            continue
    return tuple(heard)


def unknown(silenced: Sequence[str]) -> Iterable[str]:
    """A problem for each name that no warning has, with its remedy."""
    for name in silenced:
        if name not in ADVICE:
            near = difflib.get_close_matches(name, ADVICE, 1)
            hint = f"did you mean {near[0]!r}?" if near else "take it out"
            yield f"silence: no warning is called {name!r}; {hint} (known: {', '.join(ADVICE)})"
