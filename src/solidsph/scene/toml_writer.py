"""Writer of scenes as TOML text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import tomli_w

from solidsph.errors import SceneError
from solidsph.registry.construct import describe
from solidsph.scene.named_files import written_to
from solidsph.scene.scene_data import (
    RECOMMENDED,
    BodyScene,
    ImposedScene,
    PartLike,
    ReferenceScene,
    SceneData,
)


def toml_of(scene: SceneData, folder: Path | None = None) -> str:
    """TOML text from which an equal scene is read.

    Args:
        scene: to write.
        folder: of the file that the text is for; None for no file.

    Raises:
        SceneError: the scene holds objects or functions that cannot be written to a file.
    """
    tolerance, engine = scene.energy_tolerance, scene.engine
    usual = attrs.fields(SceneData).energy_tolerance.default
    table = {
        "title": scene.title or None,
        "scheme": scene.scheme if scene.scheme != RECOMMENDED else None,
        "duration": scene.duration,
        "outputs": scene.outputs,
        "engine": engine if isinstance(engine, str) else _part("engines", engine),
        "energy_tolerance": None if tolerance == usual else tolerance,
        "silence": scene.silence or None,
        "body": {name: _body(body) for name, body in scene.bodies.items()},
        "kernel": _kernel(scene),
        "material": _optional("materials", scene.material),
        "formulation": _optional("formulations", scene.formulation),
        "integrator": _integrator(scene) if scene.statics is None else None,
        "statics": scene.statics and attrs.asdict(scene.statics),
        "sleep": scene.sleep and attrs.asdict(scene.sleep),
        "boundary": _imposed("boundaries", scene.boundaries),
        "effect": _imposed("effects", scene.effects),
        "initial": [attrs.asdict(entry) for entry in scene.initial] or None,
        "probe": [attrs.asdict(entry) for entry in scene.probes] or None,
        "reference": [_reference(entry) for entry in scene.references] or None,
    }
    plain = {key: _plain(v, key) for key, v in table.items() if v is not None}
    return tomli_w.dumps(plain if folder is None else written_to(plain, folder))


def _body(body: BodyScene) -> dict[str, Any]:
    return {
        "shape": _part("shapes", body.shape),
        "spacing": body.spacing,
        "discretisation": _optional("discretisations", body.discretisation),
        "material": _optional("materials", body.material),
        "refine": list(body.refine) or None,
        "tags": body.tags or None,
    }


def _kernel(scene: SceneData) -> Mapping[str, Any] | None:
    kernel = _optional("kernels", scene.kernel) or {}
    return {**kernel, "cover": scene.cover} if kernel or scene.cover is not None else None


def _integrator(scene: SceneData) -> dict[str, Any]:
    name = "time_step_factor" if scene.time_step is None else "time_step"
    integrator = _optional("integrators", scene.integrator) or {}
    return {**integrator, name: getattr(scene, name)}


def _imposed(kind: str, entries: Sequence[ImposedScene]) -> list[Mapping[str, Any]] | None:
    return [{**_part(kind, e.part), "label": e.label or None} for e in entries] or None


def _reference(reference: ReferenceScene) -> dict[str, Any]:
    return {**attrs.asdict(reference), "source": reference.source or None}


def _optional(kind: str, part: PartLike | None) -> Mapping[str, Any] | None:
    return None if part is None else _part(kind, part)


def _part(kind: str, part: PartLike) -> Mapping[str, Any]:
    if isinstance(part, str):
        return {"type": part}
    return part if isinstance(part, Mapping) else describe(kind, part)


def _plain(value: Any, path: str) -> Any:
    """`value`, found at `path` of the file, as TOML types; None is left out of tables."""
    if isinstance(value, Mapping):
        return {k: _plain(v, f"{path}.{k}") for k, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(v, path) for v in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (bool, int, float, str)):
        return value
    raise SceneError(
        f"{path} = {value!r} cannot be written to a file; replace it by a number, a name or a "
        "formula"
    )
