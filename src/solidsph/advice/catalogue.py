"""All warnings, and those that a scene gets."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import import_module

import attrs
import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.run.built_scene import BuiltScene

Check = Callable[[SceneFacts], Iterator[Advice]]

_NAMES = (
    "nothing-happens",
    "units",
    "overloaded",
    "unheld",
    "several-faces",
    "few-across",
    "small-cover",
    "large-cover",
    "half-supports",
    "surface-rows",
    "near-incompressible",
    "unseen-motions",
    "bar-speed",
    "sudden-load",
    "slow-load",
    "bodies-meet",
    "pressed-at-start",
    "deep-clamp",
    "viscosity-unneeded",
    "hourglass-unneeded",
    "overdamped",
    "twice",
    "coarse-outputs",
    "few-steps",
    "small-step",
)


def _check(name: str) -> Check:
    """The function of a warning: the file and the function have its name."""
    word = name.replace("-", "_")
    check: Check = getattr(import_module(f"solidsph.advice.{word}"), word)
    return check


ADVICE: Mapping[str, Check] = {name: _check(name) for name in _NAMES}
"""Every warning by its name, in the order in which a scene gets them."""


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
