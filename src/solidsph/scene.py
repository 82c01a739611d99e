"""Scene: what a user asks for, as plain data; TOML in and out.

A scene holds names, numbers and formulas. In Python, objects may stand where a name would; such
a scene runs, and can be written to a file if its parts are registered.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, TypeAlias

import attrs
import tomli_w

from solidsph.errors import SceneError
from solidsph.parts import describe
from solidsph.where import EVERYWHERE, Where

PartLike: TypeAlias = str | Mapping[str, Any] | object
"""A registered name, a table with a `type` and parameters, or the part itself."""


@attrs.frozen
class BodyScene:
    """One body: where its material is and how finely it is resolved."""

    shape: PartLike
    spacing: float  # [m]
    discretisation: PartLike = "lattice"
    material: PartLike | None = None  # the scene's own if None
    tags: Mapping[str, Where] = attrs.field(factory=dict)  # named sets of its particles


@attrs.frozen
class ImposedScene:
    """A boundary or an effect, and the label of its account."""

    part: PartLike
    label: str | None = None


@attrs.frozen
class InitialScene:
    """Displacement and velocity at the start of some particles; a later entry overrides."""

    where: Where = EVERYWHERE
    displacement: Mapping[str, Any] | None = None  # {x = "0.2*X"} [m]
    velocity: Mapping[str, Any] | None = None  # [m/s]


@attrs.frozen
class StaticsScene:
    """That the scene is to be found in equilibrium instead of moving; see `statics.equilibrium`."""

    load_steps: int = 1  # to begin with
    tolerance: float = 1e-9  # imbalance over loads and reactions [-]
    max_iterations: int = 25  # of Newton's method in a load step


@attrs.frozen
class SleepScene:
    """That regions which nothing has reached cost nothing; see `solidsph.asleep`."""

    tolerance: float = 1e-9  # of the largest speed, below which a region sleeps [-]
    slabs: int = 160  # regions across the longest side of the body


DEFAULT_INTEGRATOR = "velocity-verlet"

OFF = "off"
"""The `energy_tolerance` of a scene whose energies nobody is to judge."""


@attrs.frozen
class Scene:
    """Everything that a run depends on."""

    bodies: Mapping[str, BodyScene]
    duration: float  # [s]
    title: str = ""
    kernel: PartLike = "modified-mollifier"
    cover: float = 3.5  # support radius in particle spacings [-]
    material: PartLike | None = None
    formulation: PartLike = "total-lagrangian"
    boundaries: Sequence[ImposedScene] = ()
    effects: Sequence[ImposedScene] = ()
    initial: Sequence[InitialScene] = ()
    integrator: PartLike | None = None  # None names none: then it is the default
    sleep: SleepScene | None = None  # regions that nothing has reached cost nothing
    statics: StaticsScene | None = None  # equilibrium at the end of the duration, not motion
    time_step_factor: float = 0.5  # of the CFL step
    time_step: float | None = None  # [s]; overrides the factor
    outputs: int = 200  # recorded states after the first
    engine: str = "auto"
    energy_tolerance: float | str = 0.01  # energy residual over energy in play, or "off" [-]
    silence: Sequence[str] = ()  # names of warnings that are not to be shown

    @classmethod
    def read(cls, path: Path) -> Scene:
        """From a TOML file.

        Raises:
            SceneError: the file is missing, is not TOML, or says something unknown.
        """
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as cause:
            raise SceneError(f"scene {str(path)!r} cannot be read: {cause}") from None
        return cls.from_toml(text, str(path))

    @classmethod
    def from_toml(cls, text: str, origin: str = "scene") -> Scene:
        """From TOML text; `origin` is named in errors."""
        try:
            table = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError) as cause:
            raise SceneError(f"{origin} is not valid TOML: {cause}") from None
        try:
            return _scene(table)
        except SceneError as cause:
            raise SceneError(f"{origin}: {cause}") from None

    def to_toml(self) -> str:
        """TOML text from which an equal scene is read.

        Raises:
            SceneError: the scene holds objects or functions that a file cannot.
        """
        return tomli_w.dumps(_table(self))


_SECTIONS = {
    "body": "[body.NAME]",
    "kernel": "[kernel]",
    "material": "[material]",
    "formulation": "[formulation]",
    "boundary": "[[boundary]]",
    "effect": "[[effect]]",
    "initial": "[[initial]]",
    "integrator": "[integrator]",
    "sleep": "[sleep]",
    "statics": "[statics]",
}
_SCALARS = ("title", "duration", "outputs", "engine", "energy_tolerance", "silence")


def _scene(table: Mapping[str, Any]) -> Scene:
    _check_keys(table, (*_SCALARS, *_SECTIONS), "scene")
    bodies = _mapping(table.get("body", {}), "body")
    if not bodies:
        raise SceneError("no body; add a table [body.NAME] with a shape and a spacing")
    if "duration" not in table:
        raise SceneError("no duration; add duration = ... in seconds")
    values: dict[str, Any] = {
        "bodies": {name: _body(name, body) for name, body in bodies.items()},
        "duration": number(table["duration"], "duration"),
        "boundaries": [_imposed(one, "boundary") for one in _list(table, "boundary")],
        "effects": [_imposed(one, "effect") for one in _list(table, "effect")],
        "initial": [_initial(one) for one in _list(table, "initial")],
    }
    for key in ("title", "engine"):
        if key in table:
            values[key] = _text(table[key], key)
    if "outputs" in table:
        values["outputs"] = _count(table["outputs"], "outputs")
    if "energy_tolerance" in table:
        values["energy_tolerance"] = table["energy_tolerance"]
    if "silence" in table:
        values["silence"] = _names(table["silence"], "silence")
    for key in ("material", "formulation"):
        if key in table:
            values[key] = table[key]
    if "sleep" in table:
        values["sleep"] = _sleep(table["sleep"])
    if "statics" in table:
        values["statics"] = _statics(table["statics"])
    for key, extra in (("kernel", ("cover",)), ("integrator", ("time_step_factor", "time_step"))):
        if key in table:
            part = table[key]
            if isinstance(part, Mapping):
                part = dict(part)
                for name in extra:
                    if name in part:
                        values[name] = number(part.pop(name), f"{key}.{name}")
                if not part:
                    continue
            values[key] = part
    return Scene(**values)


def _body(name: str, body: Any) -> BodyScene:
    body = _mapping(body, f"body.{name}")
    _check_keys(body, [field.name for field in attrs.fields(BodyScene)], f"body.{name}")
    for key, unit in (("shape", "a shape"), ("spacing", "metres")):
        if key not in body:
            raise SceneError(f"body.{name}: no {key}; add {key} = ... ({unit})")
    tags = _mapping(body.get("tags", {}), f"body.{name}.tags")
    return BodyScene(
        **{
            **body,
            "spacing": number(body["spacing"], f"body.{name}.spacing"),
            "tags": {tag: _text(where, f"body.{name}.tags.{tag}") for tag, where in tags.items()},
        }
    )


def _imposed(entry: Any, what: str) -> ImposedScene:
    if isinstance(entry, str):
        return ImposedScene(entry)
    part = dict(_mapping(entry, what))
    label = part.pop("label", None)
    return ImposedScene(part, None if label is None else _text(label, f"{what}.label"))


def _initial(entry: Any) -> InitialScene:
    entry = _mapping(entry, "initial")
    _check_keys(entry, [field.name for field in attrs.fields(InitialScene)], "initial")
    return InitialScene(**entry)


def _sleep(entry: Any) -> SleepScene:
    entry = dict(_mapping(entry, "sleep"))
    _check_keys(entry, [field.name for field in attrs.fields(SleepScene)], "sleep")
    if "slabs" in entry:
        _count(entry["slabs"], "sleep.slabs")
    if "tolerance" in entry:
        entry["tolerance"] = number(entry["tolerance"], "sleep.tolerance")
    return SleepScene(**entry)


def _statics(entry: Any) -> StaticsScene:
    entry = dict(_mapping(entry, "statics"))
    _check_keys(entry, [field.name for field in attrs.fields(StaticsScene)], "statics")
    for key in ("load_steps", "max_iterations"):
        if key in entry:
            _count(entry[key], f"statics.{key}")
    if "tolerance" in entry:
        entry["tolerance"] = number(entry["tolerance"], "statics.tolerance")
    return StaticsScene(**entry)


def number(value: Any, what: str) -> float:
    """`value` as a finite float; SceneError otherwise."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise SceneError(f"{what} must be a number, got {value!r}")
    try:
        result = float(value)
    except OverflowError:
        result = float("inf")
    if not isfinite(result):
        raise SceneError(f"{what} must be finite, got {value!r}")
    return result


def _count(value: Any, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise SceneError(f"{what} must be a whole number, got {value!r}")
    return value


def _names(value: Any, what: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise SceneError(f'{what} must be a list of names such as ["few-across"], got {value!r}')
    return tuple(_text(one, what) for one in value)


def _text(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise SceneError(f"{what} must be text, got {value!r}")
    return value


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        shown = _SECTIONS.get(what, f"a table {what}")
        raise SceneError(f"{what} must be a table, got {value!r}; write {shown}")
    return value


def _list(table: Mapping[str, Any], key: str) -> list[Any]:
    value = table.get(key, [])
    if not isinstance(value, list):
        raise SceneError(f"{key} must be a list of tables; write {_SECTIONS[key]}")
    return value


def _check_keys(table: Mapping[str, Any], known: Sequence[str], what: str) -> None:
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(f"{what}: unknown key {key!r}; {hint}")


def _table(scene: Scene) -> dict[str, Any]:
    table: dict[str, Any] = {}
    if scene.title:
        table["title"] = scene.title
    table |= {"duration": scene.duration, "outputs": scene.outputs, "engine": scene.engine}
    if scene.energy_tolerance != attrs.fields(Scene).energy_tolerance.default:
        table["energy_tolerance"] = scene.energy_tolerance
    if scene.silence:
        table["silence"] = list(scene.silence)
    table["body"] = {name: _body_table(body) for name, body in scene.bodies.items()}
    table["kernel"] = {**_part(scene.kernel, "kernels"), "cover": scene.cover}
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
