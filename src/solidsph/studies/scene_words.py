"""Words by which any scene can be changed, whatever case it is of: kernel, gradient, step ..."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import construct, describe
from solidsph.scene.default_cover import cover_of
from solidsph.scene.graded_spacing import is_graded, least_spacing, scaled
from solidsph.scene.keys import is_key, with_key
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import DEFAULT_FACTOR, RECOMMENDED, ImposedScene, PartLike
from solidsph.scene.scheme import completed, scheme_of

_CONTROL = "hourglass-control"


@final
@attrs.frozen
class SceneWord:
    """What a word means in a scene."""

    read: Callable[[Scene], Any]  # its value, that of the scheme where the scene names none
    change: Callable[[Scene, Any], Scene]  # the scene with another value


def changed(scene: Scene, name: str, value: Any) -> Scene:
    """`scene` with another value of a word, at a key of its file, or of "effect.parameter"."""
    if name in WORDS:
        return WORDS[name].change(scene, value)
    return with_key(scene, name, value) if is_key(name) else _with_effect(scene, name, value)


def is_word(name: str) -> bool:
    """Whether `changed` may know the name: what has a dot is looked up in a scene."""
    return name in WORDS or "." in name or is_key(name)


# Keys of a scene file that say how it is simulated, not what.
_HOW = ("kernel.", "formulation.", "integrator.", "statics.")
_OF_A_BODY = ("spacing", "discretisation")
_NUMERICAL = ("artificial-viscosity", _CONTROL)
_WHAT = ("material", "duration", "outputs")  # words that are no part of the scheme


def is_of_the_scheme(scene: Scene, name: str) -> bool:
    """Whether a word or a key says how `scene` is simulated, so that any value has the same limit.

    Its loads, materials and shapes say what is simulated.
    """
    if name in WORDS:
        return name not in _WHAT
    parts = name.split(".")
    if parts[0] == "body":
        return len(parts) > 2 and parts[2] in _OF_A_BODY
    if parts[0] == "effect":
        types = {
            label: _table("effects", effect.part)["type"]
            for effect in scene.effects
            for label in (effect.label, _table("effects", effect.part)["type"])
        }
        return types.get(parts[1]) in _NUMERICAL
    return name.startswith(_HOW) or parts[0] in _NUMERICAL


def named(scene: Scene) -> frozenset[str]:
    """Words of the scheme that a scene states by itself, such as its gradient.

    What it leaves out is chosen by the scheme (`solidsph.scene.scheme`).
    """
    formulation = _table("formulations", scene.formulation or {})
    usual = scheme_of(scene).formulation["type"]
    stated = {
        "scheme": scene.scheme != RECOMMENDED,
        "discretisation": any(b.discretisation is not None for b in scene.bodies.values()),
        "formulation": formulation.get("type", usual) != usual,
        "time_step_factor": scene.time_step_factor != DEFAULT_FACTOR,
        "hourglass": any(_table("effects", e.part)["type"] == _CONTROL for e in scene.effects),
        **{word: word in formulation for word in ("gradient", "divergence")},
        **{
            word: getattr(scene, word) is not None
            for word in ("kernel", "cover", "integrator", "time_step")
        },
    }
    return frozenset(word for word, is_stated in stated.items() if is_stated)


def smallest_spacing(scene: Scene) -> float:
    """Smallest particle spacing of its bodies [m]."""
    return min(map(least_spacing, scene.bodies.values()))


def _with_spacing(scene: Scene, value: Any) -> Scene:
    """`scene` with this as its smallest spacing; those of other bodies keep their ratio to it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < inf:
        raise SceneError(f"spacing must be a length in metres, got {value!r}")
    least = smallest_spacing(scene)
    factor = value / least
    bodies = {
        name: scaled(body, factor)
        if is_graded(body) or least_spacing(body) > least
        else attrs.evolve(body, spacing=value)
        for name, body in scene.bodies.items()
    }
    return attrs.evolve(scene, bodies=bodies)


def _field(name: str) -> SceneWord:
    return SceneWord(
        lambda scene: _short(getattr(completed(scene), name)),
        lambda scene, value: attrs.evolve(scene, **{name: value}),
    )


def _operator(key: str) -> SceneWord:
    """A part of the formulation."""
    return SceneWord(partial(_of_formulation, key=key), partial(_with_formulation, key=key))


def _of_formulation(scene: Scene, key: str) -> Any:
    return _short(_table("formulations", completed(scene).formulation).get(key))


def _with_formulation(scene: Scene, value: Any, key: str) -> Scene:
    table = {"type": _of_formulation(scene, "type")}
    if scene.formulation is not None:
        table = _table("formulations", scene.formulation)
    if key == "type":  # another formulation knows nothing of the scheme's gradient
        table = _table("formulations", completed(scene).formulation)
    return attrs.evolve(scene, formulation={**table, key: value})


def _precision(scene: Scene) -> str:
    return "float32" if _short(scene.engine) == "compiled-float32" else "float64"


def _with_precision(scene: Scene, value: Any) -> Scene:
    engines = {"float64": "compiled", "float32": "compiled-float32"}
    if value not in engines:
        raise SceneError(f"precision {value!r} is unknown; take float64 or float32")
    return attrs.evolve(scene, engine=engines[value])


def _with_discretisation(scene: Scene, value: Any) -> Scene:
    bodies = {name: attrs.evolve(body, discretisation=value) for name, body in scene.bodies.items()}
    return attrs.evolve(scene, bodies=bodies)


def _discretisation(scene: Scene) -> Any:
    return _short(next(iter(completed(scene).bodies.values())).discretisation)


def _control(scene: Scene) -> float:
    """Strength of hourglass control, 0 without it."""
    tables = [_table("effects", effect.part) for effect in scene.effects]
    found = [table for table in tables if table["type"] == _CONTROL]
    if not found:
        return 0.0
    part: Any = construct("effects", found[0])
    return float(part.strength)


def _with_control(scene: Scene, value: Any) -> Scene:
    if value != 0.0:
        return _with_effect(scene, f"{_CONTROL}.strength", value)
    rest = (e for e in scene.effects if _table("effects", e.part)["type"] != _CONTROL)
    return attrs.evolve(scene, effects=tuple(rest))


def _with_effect(scene: Scene, key: str, value: Any) -> Scene:
    """`scene` with another parameter of an effect, which is added if necessary."""
    name, _, parameter = key.partition(".")
    effects = [_table("effects", effect.part) for effect in scene.effects]
    labels = [effect.label for effect in scene.effects]
    if name not in [table["type"] for table in effects]:
        effects, labels = [*effects, {"type": name}], [*labels, None]
    return attrs.evolve(
        scene,
        effects=[
            ImposedScene({**table, parameter: value} if table["type"] == name else table, label)
            for table, label in zip(effects, labels, strict=True)
        ],
    )


def _table(kind: str, part: PartLike) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": part}
    return dict(part) if isinstance(part, Mapping) else describe(kind, part)


def _short(part: Any) -> Any:
    """A table with a type alone as its name, as a user writes it."""
    return part["type"] if isinstance(part, Mapping) and set(part) == {"type"} else part


_FIELDS = (
    *("scheme", "kernel", "material", "engine"),
    *("integrator", "time_step_factor", "time_step", "duration", "outputs"),
)

WORDS: Mapping[str, SceneWord] = {
    "spacing": SceneWord(smallest_spacing, _with_spacing),
    "discretisation": SceneWord(_discretisation, _with_discretisation),
    "cover": SceneWord(cover_of, _field("cover").change),
    "formulation": _operator("type"),
    "gradient": _operator("gradient"),
    "divergence": _operator("divergence"),
    "hourglass": SceneWord(_control, _with_control),
    "precision": SceneWord(_precision, _with_precision),
    **{name: _field(name) for name in _FIELDS},
}
"""Words by name. "hourglass" is the strength of hourglass control [-], which 0 takes away."""
