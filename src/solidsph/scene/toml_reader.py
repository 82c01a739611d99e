"""Reading: from the text of a scene to the scene, with all of its mistakes told together."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from itertools import islice
from math import isfinite
from pathlib import Path
from reprlib import repr as short
from typing import Any

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph.registry.problems import Problems, listed
from solidsph.scene.placed_parts import wrong_besides
from solidsph.scene.scene_data import (
    BodyScene,
    ImposedScene,
    InitialScene,
    SceneData,
    SleepScene,
    StaticsScene,
)
from solidsph.system.encoding import decoded
from solidsph.system.files import content

# Of a scene file: more than any list of vertices takes, less than any memory has.
MOST_BYTES = 2**26

_MOST_FILES = 10_000  # of a folder, to be compared with a name that is wrong

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
_PARTS_OF_A_BODY = {
    "shape": "shapes",
    "discretisation": "discretisations",
    "material": "materials",
}
_SCALARS = ("title", "duration", "outputs", "engine", "energy_tolerance", "silence")


def text_of(path: Path) -> str:
    """The text of a scene file.

    Raises:
        SceneError: it cannot be read, or is not in UTF-8.
    """
    try:
        if path.is_dir():
            inside = sorted(one.name for one in path.glob("*.toml") if one.is_file())
            hint = f"such as {str(path / inside[0])!r}" if inside else "of which it holds none"
            raise OSError(f"it is a folder; give a scene file, {hint}")
        if not path.exists():
            raise OSError(f"there is no such file{near(str(path))}")
        return decoded(content(path, MOST_BYTES))
    except (OSError, ValueError) as cause:
        raise SceneError(f"scene {str(path)!r} cannot be read: {cause}") from None


def near(wanted: str, *others: str) -> str:
    """A hint at the scene files beside the one `wanted`, and the `others`, that are called much
    like it."""
    path = Path(wanted)
    files = [one for one in islice(path.parent.glob("*.toml"), _MOST_FILES) if one.is_file()]
    called = {name: str(file) for file in files for name in (file.name, file.stem)}
    called |= {name: name for name in others}
    found = dict.fromkeys(called[name] for name in get_close_matches(path.name, called, 6))
    return f"; did you mean {' or '.join(map(repr, list(found)[:3]))}?" if found else ""


def words(text: str, origin: str) -> dict[str, Any]:
    """The fields of a scene, from TOML text; `origin` is named in errors.

    Raises:
        SceneError: as `Scene.from_toml`.
    """
    if not text.strip():
        raise SceneError(f"{origin} is empty; `solidsph run CASE --write scene.toml` writes one")
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as cause:
        raise SceneError(f"{origin} is not valid TOML: {cause}") from None
    problems = Problems()
    values, complete = _words(table, problems)
    if problems.found:
        problems.add(wrong_besides(SceneData(**values), complete=complete))
        raise SceneError(listed(origin, problems.found))
    return values


def _words(table: Mapping[str, Any], problems: Problems) -> tuple[dict[str, Any], bool]:
    """The words that could be understood, and whether all of the bodies are there."""
    _check_keys(table, (*_SCALARS, *_SECTIONS), "scene", problems)
    values: dict[str, Any] = {"duration": 1.0}

    def take(key: str, read: Callable[..., Any], *arguments: Any) -> None:
        found = problems.attempt(read, *arguments)
        if found is not None:
            values[key] = found

    if "duration" in table:
        take("duration", number, table["duration"], "duration")
    elif not _meant(table, "duration"):
        problems.add(["no duration; add duration = ... in seconds"])
    bodies = problems.attempt(_mapping, table.get("body", {}), "body") or {}
    if not bodies and not isinstance(table.get("body"), list) and not _meant(table, "body"):
        problems.add(["no body; add a table [body.NAME] with a shape and a spacing"])
    before = len(problems.found)
    made = {name: problems.attempt(_body, name, body, problems) for name, body in bodies.items()}
    values["bodies"] = {name: body for name, body in made.items() if body is not None}
    complete = bool(bodies) and len(problems.found) == before
    for key, field, read in (
        ("boundary", "boundaries", _imposed),
        ("effect", "effects", _imposed),
        ("initial", "initial", _initial),
    ):
        entries = problems.attempt(_list, table, key) or []
        found = [problems.attempt(read, entry, key, problems) for entry in entries]
        values[field] = [one for one in found if one is not None]
    for key in ("title", "engine"):
        if key in table:
            take(key, _text, table[key], key)
    if "outputs" in table:
        take("outputs", _count, table["outputs"], "outputs")
    if "silence" in table:
        take("silence", _names, table["silence"], "silence")
    for key in ("energy_tolerance", "material", "formulation"):
        if key in table:
            values[key] = table[key]
    for key, kind in (("sleep", SleepScene), ("statics", StaticsScene)):
        if key in table:
            take(key, _numbers, table[key], key, kind, problems)
    for key, extra in (("kernel", ("cover",)), ("integrator", ("time_step_factor", "time_step"))):
        if key in table:
            part = table[key]
            if isinstance(part, Mapping):
                part = dict(part)
                for name in extra:
                    if name in part:
                        take(name, number, part.pop(name), f"{key}.{name}")
                if not part:
                    continue
            values[key] = part
    return values, complete


def _body(name: str, body: Any, problems: Problems) -> BodyScene | None:
    what = f"body.{name}"
    fields = [field.name for field in attrs.fields(BodyScene)]
    known = _check_keys(_mapping(body, what), fields, what, problems)
    for key, unit in (("shape", "a shape"), ("spacing", "metres")):
        if key not in known and not _meant(body, key, fields):
            problems.add([f"{what}: no {key}; add {key} = ... ({unit})"])
    tags = problems.attempt(_mapping, known.pop("tags", {}), f"{what}.tags") or {}
    read = {tag: problems.attempt(_text, at, f"{what}.tags.{tag}") for tag, at in tags.items()}
    if "spacing" in known:
        known["spacing"] = problems.attempt(number, known["spacing"], f"{what}.spacing")
    if "shape" not in known or known.get("spacing") is None:
        # There is no body then, but what it names may be wrong as well.
        for key, kind in _PARTS_OF_A_BODY.items():
            if key in known:
                problems.attempt(construct, kind, known[key])
        return None
    return BodyScene(**known, tags={tag: at for tag, at in read.items() if at is not None})


def _imposed(entry: Any, what: str, problems: Problems) -> ImposedScene:
    if isinstance(entry, str):
        return ImposedScene(entry)
    part = dict(_mapping(entry, what))
    label = part.pop("label", None)
    named = None if label is None else problems.attempt(_text, label, f"{what}.label")
    return ImposedScene(part, named)


def _initial(entry: Any, what: str, problems: Problems) -> InitialScene:
    fields = [field.name for field in attrs.fields(InitialScene)]
    return InitialScene(**_check_keys(_mapping(entry, what), fields, what, problems))


def _numbers(entry: Any, what: str, kind: type[Any], problems: Problems) -> Any:
    """[sleep] or [statics]: counts where the default is one, else numbers."""
    fields = {field.name: field for field in attrs.fields(kind)}
    known = _check_keys(_mapping(entry, what), list(fields), what, problems)
    read = {
        key: problems.attempt(
            _count if isinstance(fields[key].default, int) else number, value, f"{what}.{key}"
        )
        for key, value in known.items()
    }
    return kind(**{key: value for key, value in read.items() if value is not None})


def number(value: Any, what: str) -> float:
    """`value` as a finite float; SceneError otherwise."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise SceneError(f"{what} must be a number, got {value!r}")
    try:
        result = float(value)
    except OverflowError:
        raise SceneError(f"{what} must be finite, got {short(value)}, beyond 1.8e308") from None
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


def _check_keys(
    table: Mapping[str, Any], known: Sequence[str], what: str, problems: Problems
) -> dict[str, Any]:
    """What of the `table` is known; the rest is noted."""
    for key in table:
        if key not in known:
            near = get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            problems.add([f"{what}: unknown key {key!r}; {hint}"])
    return {key: value for key, value in table.items() if key in known}


def _meant(
    table: Mapping[str, Any], key: str, known: Iterable[str] = (*_SCALARS, *_SECTIONS)
) -> bool:
    """Whether an unknown key of the `table` is told to be this one, mistyped."""
    known = list(known)
    return any(one not in known and get_close_matches(one, known, 1) == [key] for one in table)
