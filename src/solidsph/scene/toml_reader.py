"""Reader of scenes from TOML text, which reports all mistakes together."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from itertools import islice
from math import isfinite
from pathlib import Path
from reprlib import repr as short
from typing import Any, get_type_hints

import attrs

from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph.registry.problems import Problems, listed
from solidsph.scene.named_files import read_in
from solidsph.scene.placed_parts import further_problems
from solidsph.scene.scene_data import (
    DURATION_OF_EQUILIBRIA,
    BodyScene,
    ImposedScene,
    InitialScene,
    ProbeScene,
    ReferenceScene,
    SceneData,
    SleepScene,
    StaticsScene,
)
from solidsph.system.encoding import decoded
from solidsph.system.files import content

# Size limit of a scene file: more than any list of vertices needs, less than any memory.
MOST_BYTES = 2**26

_MOST_FILES = 10_000  # of a folder, compared with a wrong name

SECTIONS = {
    "body": "[body.NAME]",
    "kernel": "[kernel]",
    "material": "[material]",
    "formulation": "[formulation]",
    "boundary": "[[boundary]]",
    "effect": "[[effect]]",
    "initial": "[[initial]]",
    "probe": "[[probe]]",
    "reference": "[[reference]]",
    "integrator": "[integrator]",
    "sleep": "[sleep]",
    "statics": "[statics]",
}
SCALARS = ("title", "scheme", "duration", "outputs", "engine", "energy_tolerance", "silence")
_KEYS = (*SCALARS, *SECTIONS)

# Fields of a scene that stand in the table of a part.
_NESTED = {"kernel": ("cover",), "integrator": ("time_step_factor", "time_step")}

_PARTS_OF_A_BODY = {
    "shape": "shapes",
    "discretisation": "discretisations",
    "material": "materials",
}


def read_text(path: Path) -> str:
    """Text of a scene file.

    Raises:
        SceneError: the file cannot be read, or is not in UTF-8.
    """
    try:
        if path.is_dir():
            inside = sorted(file.name for file in path.glob("*.toml") if file.is_file())
            hint = f"such as {str(path / inside[0])!r}" if inside else "but it contains none"
            raise OSError(f"it is a folder; give a scene file, {hint}")
        if not path.exists():
            raise OSError(f"there is no such file{similar_names(str(path))}")
        return decoded(content(path, MOST_BYTES))
    except (OSError, ValueError) as cause:
        raise SceneError(f"scene {str(path)!r} cannot be read: {cause}") from None


def similar_names(wanted: str, *others: str) -> str:
    """A hint at scene files in the folder of `wanted`, and at `others`, with a similar name."""
    path = Path(wanted)
    files = [file for file in islice(path.parent.glob("*.toml"), _MOST_FILES) if file.is_file()]
    known = {name: str(file) for file in files for name in (file.name, file.stem)}
    known |= {name: name for name in others}
    close = dict.fromkeys(known[name] for name in get_close_matches(path.name, known, 6))
    return f"; did you mean {' or '.join(map(repr, list(close)[:3]))}?" if close else ""


def read_values(text: str, origin: str, folder: Path | None = None) -> dict[str, Any]:
    """Values of the fields of a scene from TOML text; errors name `origin`.

    Args:
        text: of the scene.
        origin: where it is from.
        folder: of the file that it is from; None if it is from no file.

    Raises:
        SceneError: as `Scene.from_toml`.
    """
    if not text.strip():
        raise SceneError(
            f"{origin} is empty; `solidsph run CASE --write scene.toml` writes an example"
        )
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as cause:
        raise SceneError(f"{origin} is not valid TOML: {cause}") from None
    problems = Problems()
    values, complete = _scene(table if folder is None else read_in(table, folder), problems)
    if problems.found:
        problems.add(further_problems(SceneData(**values), complete=complete))
        raise SceneError(listed(origin, problems.found))
    return values


def _scene(table: Mapping[str, Any], problems: Problems) -> tuple[dict[str, Any], bool]:
    """All values that can be read, and whether all bodies are among them."""
    _check_keys(table, _KEYS, "scene", problems)
    given = {"duration", "statics"} & set(table)
    if not given and not _is_mistyped(table, "duration", _KEYS):
        problems.add(["no duration; add duration = ... in seconds"])
    bodies = problems.attempt(_mapping, table.get("body", {}), "body") or {}
    missing = not bodies and not isinstance(table.get("body"), list)
    if missing and not _is_mistyped(table, "body", _KEYS):
        problems.add(["no body; add a table [body.NAME] with a shape and a spacing"])
    before = len(problems.found)
    read = {name: problems.attempt(_body, name, body, problems) for name, body in bodies.items()}
    values = {
        "duration": DURATION_OF_EQUILIBRIA,
        "bodies": {name: body for name, body in read.items() if body is not None},
    }
    complete = bool(bodies) and len(problems.found) == before
    for key, field, read_entry in (
        ("boundary", "boundaries", _imposed),
        ("effect", "effects", _imposed),
        ("initial", "initial", _initial),
        ("probe", "probes", _probe),
        ("reference", "references", _reference),
    ):
        entries = problems.attempt(_list, table, key) or []
        several = [problems.attempt(read_entry, entry, key, problems) for entry in entries]
        values[field] = tuple(entry for entry in several if entry is not None)
    simple = {k: v for k, v in table.items() if k in (*SCALARS, "material", "formulation")}
    values |= _fields(SceneData, simple, "", problems)
    for key, kind in (("sleep", SleepScene), ("statics", StaticsScene)):
        if key in table:
            values[key] = problems.attempt(_simple, table[key], key, kind, problems)
    for key, nested in _NESTED.items():
        part = table.get(key)
        if isinstance(part, Mapping):
            inside = {name: part[name] for name in nested if name in part}
            values |= _fields(SceneData, inside, f"{key}.", problems)
            part = {name: value for name, value in part.items() if name not in nested}
        if part is not None and part != {}:
            values[key] = part
    return values, complete


def _fields(
    kind: type[Any], table: Mapping[str, Any], prefix: str, problems: Problems
) -> dict[str, Any]:
    """Values of `table` that are fields of `kind`, each read by the type of its field."""
    types = get_type_hints(kind)
    values = {
        key: problems.attempt(_READERS.get(types[key], _unchecked), value, f"{prefix}{key}")
        for key, value in table.items()
    }
    return {key: value for key, value in values.items() if value is not None}


def _body(name: str, body: Any, problems: Problems) -> BodyScene | None:
    what = f"body.{name}"
    fields = _names_of(BodyScene)
    known = _check_keys(_mapping(body, what), fields, what, problems)
    for key, unit in (("shape", "a shape"), ("spacing", "metres")):
        if key not in known and not _is_mistyped(body, key, fields):
            problems.add([f"{what}: no {key}; add {key} = ... ({unit})"])
    tags = problems.attempt(_mapping, known.pop("tags", {}), f"{what}.tags") or {}
    refine = problems.attempt(_entries, known.pop("refine", []), f"{what}.refine") or ()
    read = {tag: problems.attempt(_text, at, f"{what}.tags.{tag}") for tag, at in tags.items()}
    values = _fields(BodyScene, known, f"{what}.", problems)
    if "shape" not in values or "spacing" not in values:
        # There is no body, but its parts may have mistakes as well.
        for key, kind in _PARTS_OF_A_BODY.items():
            if key in values:
                problems.attempt(construct, kind, values[key])
        return None
    tags = {tag: at for tag, at in read.items() if at is not None}
    return BodyScene(**values, tags=tags, refine=refine)


def _imposed(entry: Any, what: str, problems: Problems) -> ImposedScene:
    if isinstance(entry, str):
        return ImposedScene(entry)
    part = dict(_mapping(entry, what))
    label = part.pop("label", None)
    if label is not None:
        label = problems.attempt(_text, label, f"{what}.label")
    return ImposedScene(part, label)


def _initial(entry: Any, what: str, problems: Problems) -> Any:
    return _simple(entry, what, InitialScene, problems)


def _probe(entry: Any, what: str, problems: Problems) -> Any:
    return _simple(entry, what, ProbeScene, problems)


def _reference(entry: Any, what: str, problems: Problems) -> Any:
    reference = _simple(entry, what, ReferenceScene, problems)
    if not reference.quantity:
        raise SceneError(
            f"{what}: no quantity; add quantity = ..., a column of the history or the label of a "
            "probe"
        )
    if (reference.value is None) == (reference.file is None):
        raise SceneError(
            f"{what} of {reference.quantity!r}: give either value = ..., a number or a formula, or "
            "file = ..., a table of times and values"
        )
    return reference


def _simple(entry: Any, what: str, kind: type[Any], problems: Problems) -> Any:
    """An object of class `kind` from a table of its fields."""
    known = _check_keys(_mapping(entry, what), _names_of(kind), what, problems)
    return kind(**_fields(kind, known, f"{what}.", problems))


def _names_of(kind: type[Any]) -> list[str]:
    return [field.name for field in attrs.fields(kind)]


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise SceneError(f"{what} must be a number, got {value!r}")
    try:
        result = float(value)
    except OverflowError:
        raise SceneError(f"{what} must be finite, got {short(value)}, beyond 1.8e308") from None
    if not isfinite(result):
        raise SceneError(f"{what} must be finite, got {value!r}")
    return result


def _whole_number(value: Any, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise SceneError(f"{what} must be a whole number, got {value!r}")
    return value


def _names(value: Any, what: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise SceneError(f'{what} must be a list of names such as ["few-across"], got {value!r}')
    return tuple(_text(name, what) for name in value)


def _text(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise SceneError(f"{what} must be text, got {value!r}")
    return value


def _number_or_text(value: Any, what: str) -> float | str:
    return value if isinstance(value, str) else _number(value, what)


def _number_text_or_table(value: Any, what: str) -> float | str | Mapping[str, Any]:
    return value if isinstance(value, Mapping) else _number_or_text(value, what)


def _entries(value: Any, what: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise SceneError(
            f'{what} must be a list such as [{{where = "rim", spacing = 0.01, over = 0.2}}], got '
            f"{value!r}"
        )
    return tuple(value)


def _unchecked(value: Any, what: str) -> Any:
    return value


_READERS: Mapping[Any, Callable[[Any, str], Any]] = {
    float: _number,
    float | str: _number_or_text,
    float | str | Mapping[str, Any]: _number_text_or_table,
    float | None: _number,
    int: _whole_number,
    int | None: _whole_number,
    str: _text,
    Sequence[str]: _names,
}
"""Readers by the type of a field; values of other types are checked when the scene is built."""


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        shown = SECTIONS.get(what, f"a table {what}")
        raise SceneError(f"{what} must be a table, got {value!r}; write {shown}")
    return value


def _list(table: Mapping[str, Any], key: str) -> list[Any]:
    value = table.get(key, [])
    if not isinstance(value, list):
        raise SceneError(f"{key} must be a list of tables; write {SECTIONS[key]}")
    return value


def _check_keys(
    table: Mapping[str, Any], known: Sequence[str], what: str, problems: Problems
) -> dict[str, Any]:
    """The known entries of `table`; the others are noted as problems."""
    for key in table:
        if key not in known:
            close = get_close_matches(key, known, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
            problems.add([f"{what}: unknown key {key!r}; {hint}"])
    return {key: value for key, value in table.items() if key in known}


def _is_mistyped(table: Mapping[str, Any], key: str, known: Iterable[str]) -> bool:
    """Whether the hint for some unknown key of `table` is `key`."""
    known = list(known)
    return any(name not in known and get_close_matches(name, known, 1) == [key] for name in table)
