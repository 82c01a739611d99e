"""Variant of a case: other values of its parameters, or of words that any scene has."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.results.record import Record
from solidsph.scene.keys import is_key, value_at
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement, Picture
from solidsph.studies.scene_words import WORDS, changed, is_word


def with_settings(case: Case, settings: Mapping[str, Any]) -> Case:
    """`case` with other values of its parameters, or of words that any scene has.

    Args:
        case: to be changed.
        settings: values by name: a parameter of the case, a word such as "gradient" or
            "precision" (`solidsph.studies.scene_words`), a parameter of an effect such as
            "body-force.acceleration", or a key of a scene file such as "material.density".

    Raises:
        SceneError: a name is unknown, or a value is wrong.
    """
    of, changes = (case.of, case.changes) if isinstance(case, Variant) else (case, {})
    cls: Any = type(of)
    own = [field.name for field in attrs.fields(cls)]
    changes = {**changes, **{name: v for name, v in settings.items() if name not in own}}
    for name in changes:
        if not is_word(name):
            known = sorted({*own, *WORDS})
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(
                f"{case.title!r} has no parameter {name!r}, nor has its scene; {hint}; a parameter "
                "of an effect is written effect.parameter, any other key of a scene file as there, "
                "such as body.NAME.spacing"
            )
    try:
        parameters = {name: getattr(of, name) for name in own}
        of = cls(**{**parameters, **{k: v for k, v in settings.items() if k in own}})
    except (TypeError, ValueError) as cause:
        raise SceneError(f"{case.title!r}: {cause}") from None
    return Variant(of, changes) if changes else of


def setting_of(case: Case, name: str) -> Any:
    """Value of a parameter of a case, or of a word of its first scene.

    Raises:
        SceneError: it has none of that name.
    """
    of: Any = case.of if isinstance(case, Variant) else case
    if name in [field.name for field in attrs.fields(type(of))]:
        return getattr(of, name)
    scene = next(iter(case.scenes().values()), None)
    if scene is not None and name in WORDS:
        return WORDS[name].read(scene)
    if scene is not None and is_key(name):
        return value_at(scene, name)
    raise SceneError(f"{case.title!r} has no parameter {name!r}, nor has its scene")


@final
@attrs.frozen
class Variant(Case):
    """A case whose scenes are changed before they are run."""

    of: Case
    changes: Mapping[str, Any]

    @property
    def title(self) -> str:  # type: ignore[override]  # of the case that varies
        return self.of.title

    @property
    def source(self) -> str:  # type: ignore[override]
        return self.of.source

    @property
    def sweep(self) -> Mapping[str, Sequence[Any]]:  # type: ignore[override]
        return self.of.sweep

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {}
        for name, scene in self.of.scenes().items():
            for key, value in self.changes.items():
                scene = changed(scene, key, value)
            scenes[name] = scene
        return scenes

    def priced(self) -> Case:
        return attrs.evolve(self, of=self.of.priced())

    @property
    def resolution(self) -> float:
        changes = any(name == "spacing" or name.startswith("body.") for name in self.changes)
        return super().resolution if changes else self.of.resolution

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return self.of.measure(records)

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        return self.of.accuracy(measurements)

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Picture]:
        return self.of.pictures(records)

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return self.of.draw(records, folder)

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        return self.of.curves(records)
