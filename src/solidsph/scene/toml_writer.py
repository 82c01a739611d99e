"""The TOML text of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import tomli_w

from solidsph.errors import SceneError
from solidsph.registry.construct import describe
from solidsph.scene.scene_data import DEFAULT_INTEGRATOR, BodyScene, PartLike, SceneData


def toml_of(scene: SceneData) -> str:
    """TOML text from which an equal scene is read.

    Raises:
        SceneError: the scene holds objects or functions that a file cannot.
    """
    return tomli_w.dumps(_table(scene))


def _table(scene: SceneData) -> dict[str, Any]:
    table: dict[str, Any] = {}
    if scene.title:
        table["title"] = scene.title
    table |= {"duration": scene.duration, "outputs": scene.outputs, "engine": _engine(scene.engine)}
    if scene.energy_tolerance != attrs.fields(SceneData).energy_tolerance.default:
        table["energy_tolerance"] = scene.energy_tolerance
    if scene.silence:
        table["silence"] = list(scene.silence)
    table["body"] = {name: _body_table(body) for name, body in scene.bodies.items()}
    table["kernel"] = _part(scene.kernel, "kernels")
    if scene.cover is not None:
        table["kernel"] = {**table["kernel"], "cover": scene.cover}
    if scene.material is not None:
        table["material"] = _part(scene.material, "materials")
    table["formulation"] = _part(scene.formulation, "formulations")
    if scene.statics is None:
        step = (
            {"time_step_factor": scene.time_step_factor}
            if scene.time_step is None
            else {"time_step": scene.time_step}
        )
        integrator = _part(scene.integrator or DEFAULT_INTEGRATOR, "integrators")
        table["integrator"] = {**integrator, **step}
    else:
        table["statics"] = attrs.asdict(scene.statics)
    if scene.sleep is not None:
        table["sleep"] = attrs.asdict(scene.sleep)
    for key, kind, entries in (
        ("boundary", "boundaries", scene.boundaries),
        ("effect", "effects", scene.effects),
    ):
        rows = [
            {**_part(one.part, kind), **({"label": one.label} if one.label else {})}
            for one in entries
        ]
        if rows:
            table[key] = rows
    if scene.initial:
        table["initial"] = [
            {k: _writable(v, f"initial.{k}") for k, v in attrs.asdict(one).items() if v is not None}
            for one in scene.initial
        ]
    return table


def _body_table(body: BodyScene) -> dict[str, Any]:
    table: dict[str, Any] = {
        "shape": _part(body.shape, "shapes"),
        "spacing": body.spacing,
        "discretisation": _part(body.discretisation, "discretisations"),
    }
    if body.material is not None:
        table["material"] = _part(body.material, "materials")
    if body.tags:
        table["tags"] = {tag: _writable(where, f"tags.{tag}") for tag, where in body.tags.items()}
    return table


def _engine(engine: PartLike) -> object:
    return engine if isinstance(engine, str) else _part(engine, "engines")


def _part(part: PartLike, kind: str) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": part}
    if isinstance(part, Mapping):
        written: dict[str, Any] = _writable(part, kind)
        return written
    return describe(kind, part)


def _writable(value: Any, what: str) -> Any:
    if isinstance(value, Mapping):
        return {k: _writable(v, f"{what}.{k}") for k, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_writable(v, what) for v in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (bool, int, float, str)):
        return value
    raise SceneError(
        f"{what} = {value!r} cannot be written to a file; state it as a number, a name or a formula"
    )
