"""Varied: a case with other words in its scenes than it has parameters for."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import describe
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import ImposedScene, PartLike
from solidsph.studies.case import Case, Measurement


def with_settings(case: Case, settings: Mapping[str, Any]) -> Case:
    """`case` with other values of its parameters, or of words that any scene has.

    Args:
        settings: names of parameters of the case, or else such as "formulation", "precision" or
            "hourglass-control.strength", with values.

    Raises:
        SceneError: nothing is called so, or a value is wrong.
    """
    cls: Any = type(case)
    own = [field.name for field in attrs.fields(cls)]
    words = {name: value for name, value in settings.items() if name not in own}
    for name in words:
        if name not in _WORDS and "." not in name:
            known = sorted({*own, *_WORDS})
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(
                f"{case.title!r} has no parameter {name!r}, nor has its scene; {hint}; a strength "
                "of an effect is written effect.parameter"
            )
    try:
        parameters = {name: getattr(case, name) for name in own}
        case = cls(**{**parameters, **{k: v for k, v in settings.items() if k in own}})
    except (TypeError, ValueError) as cause:
        raise SceneError(f"{case.title!r}: {cause}") from None
    return Variant(case, words) if words else case


@final
@attrs.frozen
class Variant(Case):
    """A case, its scenes changed before they are run."""

    of: Case
    words: Mapping[str, Any]

    @property
    def title(self) -> str:  # type: ignore[override]  # every case has its own, this one lends it
        return self.of.title

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {}
        for name, scene in self.of.scenes().items():
            for word, value in self.words.items():
                change = _WORDS.get(word)
                scene = change(scene, value) if change else _of_effect(scene, word, value)
            scenes[name] = scene
        return scenes

    @property
    def resolution(self) -> float:
        return self.of.resolution  # no word changes a spacing

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return self.of.measure(records)

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        return self.of.accuracy(measurements)

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return self.of.draw(records, folder)


def _of_formulation(key: str) -> Callable[[Scene, Any], Scene]:
    def change(scene: Scene, value: Any) -> Scene:
        table = _table("formulations", scene.formulation)
        return attrs.evolve(scene, formulation={**table, key: value})

    return change


def _word(field: str) -> Callable[[Scene, Any], Scene]:
    def change(scene: Scene, value: Any) -> Scene:
        return attrs.evolve(scene, **{field: value})

    return change


def _precision(scene: Scene, value: Any) -> Scene:
    engines = {"float64": "compiled", "float32": "compiled-float32"}
    if value not in engines:
        raise SceneError(f"precision {value!r} is unknown; take float64 or float32")
    return attrs.evolve(scene, engine=engines[value])


_WORDS: Mapping[str, Callable[[Scene, Any], Scene]] = {
    "formulation": _of_formulation("type"),
    "gradient": _of_formulation("gradient"),
    "divergence": _of_formulation("divergence"),
    "precision": _precision,
    **{
        word: _word(word)
        for word in (
            *("kernel", "cover", "material", "engine"),
            *("integrator", "time_step_factor", "time_step", "duration", "outputs"),
        )
    },
}


def _of_effect(scene: Scene, word: str, value: Any) -> Scene:
    """With a parameter of an effect changed; the effect is added if the scene has none."""
    name, _, parameter = word.partition(".")
    effects = [_table("effects", one.part) for one in scene.effects]
    labels = [one.label for one in scene.effects]
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
