"""Variant of a case: other values of its parameters, or of keys of its scenes."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import describe
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import ImposedScene, PartLike
from solidsph.scene.scheme import completed
from solidsph.studies.case import Case, Measurement


def with_settings(case: Case, settings: Mapping[str, Any]) -> Case:
    """`case` with other values of its parameters, or of keys that any scene has.

    Args:
        case: to be changed.
        settings: values by name: a parameter of the case, a key such as "formulation" or
            "precision", or a parameter of an effect such as "hourglass-control.strength".

    Raises:
        SceneError: a name is unknown, or a value is wrong.
    """
    cls: Any = type(case)
    own = [field.name for field in attrs.fields(cls)]
    changes = {name: value for name, value in settings.items() if name not in own}
    for name in changes:
        if name not in _CHANGES and "." not in name:
            known = sorted({*own, *_CHANGES})
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(
                f"{case.title!r} has no parameter {name!r}, nor has its scene; {hint}; a parameter "
                "of an effect is written effect.parameter"
            )
    try:
        parameters = {name: getattr(case, name) for name in own}
        case = cls(**{**parameters, **{k: v for k, v in settings.items() if k in own}})
    except (TypeError, ValueError) as cause:
        raise SceneError(f"{case.title!r}: {cause}") from None
    return Variant(case, changes) if changes else case


@final
@attrs.frozen
class Variant(Case):
    """A case whose scenes are changed before they are run."""

    of: Case
    changes: Mapping[str, Any]

    @property
    def title(self) -> str:  # type: ignore[override]  # of the case that varies
        return self.of.title

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {}
        for name, scene in self.of.scenes().items():
            for key, value in self.changes.items():
                change = _CHANGES.get(key)
                scene = change(scene, value) if change else _with_effect(scene, key, value)
            scenes[name] = scene
        return scenes

    @property
    def resolution(self) -> float:
        return self.of.resolution  # no change concerns a spacing

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return self.of.measure(records)

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        return self.of.accuracy(measurements)

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return self.of.draw(records, folder)


def _with_formulation(scene: Scene, value: Any, key: str) -> Scene:
    table = _table("formulations", completed(scene).formulation)
    return attrs.evolve(scene, formulation={**table, key: value})


def _with_field(scene: Scene, value: Any, field: str) -> Scene:
    return attrs.evolve(scene, **{field: value})


def _with_precision(scene: Scene, value: Any) -> Scene:
    engines = {"float64": "compiled", "float32": "compiled-float32"}
    if value not in engines:
        raise SceneError(f"precision {value!r} is unknown; take float64 or float32")
    return attrs.evolve(scene, engine=engines[value])


_FIELDS = (
    *("kernel", "cover", "material", "engine"),
    *("integrator", "time_step_factor", "time_step", "duration", "outputs"),
)

_CHANGES: Mapping[str, Callable[[Scene, Any], Scene]] = {
    "formulation": partial(_with_formulation, key="type"),
    "gradient": partial(_with_formulation, key="gradient"),
    "divergence": partial(_with_formulation, key="divergence"),
    "precision": _with_precision,
    **{field: partial(_with_field, field=field) for field in _FIELDS},
}


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
