"""Values of the options of `solidsph cost`: axes, an accuracy, a time, what it is of."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from solidsph.commands.target import parameters
from solidsph.errors import SceneError
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case
from solidsph.studies.cost import Axes, sweep_of
from solidsph.studies.scene_case import COARSER, SPACING, SceneCase
from solidsph.studies.scene_words import changed
from solidsph.studies.search import Goal

_UNITS = {"": 1.0, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def case_of(
    wanted: Scene | Case,
    target: str,
    of: Sequence[str] = (),
    references: Sequence[str] = (),
    levels: Sequence[float] = COARSER,
) -> Case:
    """The case to be priced: a scene becomes one, with a sweep over these parts of its spacing."""
    if isinstance(wanted, Scene):
        return SceneCase.of(wanted, of, references, levels=levels)
    if of or references:
        raise SceneError(f"--of and --reference are for a scene; the case {target!r} has its own")
    return wanted


def axes_of(texts: Sequence[str], case: Case) -> Axes:
    """Axes from "name=value,value", after the one that refines; the case's own if none is given."""
    if not texts:
        return sweep_of(case.priced())
    axes = dict(_refining(*_axis(text), case) for text in texts)
    refining, values = next(iter(case.priced().sweep.items()), ("", ()))
    if refining and refining not in axes:
        return {refining: values, **axes}
    return {name: axes[name] for name in sorted(axes, key=lambda name: name != refining)}


def _refining(name: str, values: Sequence[Any], case: Case) -> tuple[str, Sequence[Any]]:
    """That axis; the spacing of the only body of a scene is the spacing of the scene.

    Raises:
        SceneError: it refines one of several bodies, and there is no reference: the others would
            keep their error, which no refinement shows.
    """
    if not (isinstance(case, SceneCase) and re.fullmatch(r"body\.[^.]+\.spacing", name)):
        return name, values
    if case.scene.bodies.keys() == {name.split(".")[1]}:
        return SPACING, values
    if not case.references:
        changed(case.scene, name, values[0])
        raise SceneError(
            f"--axis {name}: without a reference the error is estimated by refining all bodies "
            f"together; take --axis spacing=..., with --set {name}={values[0]} for another ratio, "
            "or give a --reference"
        )
    return name, values


def _axis(text: str) -> tuple[str, Sequence[Any]]:
    name, equals, values = text.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise SceneError(f"--axis {text!r} is not of the form name=value,value")
    try:
        parsed = tomllib.loads(f"values = [{values}]")["values"]
    except tomllib.TOMLDecodeError:
        parsed = [parameters([f"v={value.strip()}"])["v"] for value in values.split(",")]
    parsed = [tuple(value) if isinstance(value, list) else value for value in parsed]
    if len({repr(value) for value in parsed}) < len(parsed):
        raise SceneError(f"--axis {text!r} has a value twice; give each once")
    return name.strip(), parsed


def goal_of(accuracy: str | None, time: str | None) -> Goal | None:
    """Goal of a search; None for a sweep."""
    if accuracy is not None:
        return Goal(error=_fraction(accuracy))
    return None if time is None else Goal(time=seconds(time, "--time"))


def _fraction(text: str) -> float:
    """ "1%" or "0.01" as a number."""
    value = _number(text, {"": 1.0, "%": 0.01})
    if not 0.0 < value < 1.0:
        raise SceneError(f"--accuracy must be between 0 and 100 %, such as 1%, got {text!r}")
    return value


def seconds(text: str, option: str) -> float:
    """ "60s", "2min" or "1h" in seconds."""
    value = _number(text, _UNITS)
    if not 0.0 < value < 1e9:
        raise SceneError(f"{option} must be a time, such as 60s, 2min or 1h, got {text!r}")
    return value


def _number(text: str, units: dict[str, float]) -> float:
    """A number times its unit; 0 if it is none."""
    match = re.fullmatch(r"\s*([+-]?[0-9.]+(?:[eE][+-]?\d+)?)\s*([a-z%]*)\s*", text)
    try:
        return float(match[1]) * units[match[2]] if match else 0.0
    except (ValueError, KeyError):
        return 0.0
