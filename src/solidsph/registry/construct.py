"""Parts from names and numbers, as scenes hold them, and back."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from typing import Any

import attrs

from solidsph.errors import PluginError, SceneError, SolidsphError
from solidsph.registry import registry
from solidsph.registry.parameters import as_number


def construct(kind: str, wanted: object) -> Any:
    """A part from its name or from a table with its `type` and parameters; a part is returned.

    Raises:
        SceneError: an unknown name, an unknown or missing parameter, or a bad value.
        PluginError: the part cannot be loaded, or its constructor is broken.
    """
    if isinstance(wanted, str):
        wanted = {"type": wanted}
    if not isinstance(wanted, Mapping):
        expected = registry.interface(kind)
        if isinstance(wanted, expected):
            return wanted
        raise SceneError(
            f"{registry.singular(kind)}: expected a name, a table with a `type`, or a "
            f"{expected.__name__} object, got {wanted!r}"
        )
    parameters = dict(wanted)
    name = parameters.pop("type", None)
    if not isinstance(name, str):
        raise SceneError(
            f"{registry.singular(kind)}: the table {dict(wanted)!r} has no `type`; give one of "
            f"{', '.join(registry.names(kind))}"
        )
    cls = registry.load(kind, name)
    label = f"{registry.singular(kind)} {name!r}"
    fields = _fields(cls, label)
    wrong: list[str] = []
    meant: set[str] = set()  # a parameter whose name is mistyped is not reported as missing too
    for key in [key for key in parameters if key not in fields]:
        near = difflib.get_close_matches(key, fields, 1)
        meant.update(near)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(fields) or 'none'}"
        wrong.append(f"unknown parameter {key!r}; {hint}")
        del parameters[key]
    missing = [
        key
        for key, field in fields.items()
        if field.default is attrs.NOTHING and key not in parameters and key not in meant
    ]
    if missing:
        wrong.append(f"missing parameter {', '.join(map(repr, missing))}; give a value")
    for key, value in parameters.items():
        try:
            nested = fields[key].metadata.get("part")
            if nested is not None:
                parameters[key] = _nested(nested, value, fields[key].type, f"{label}: {key}")
            elif wrong:  # the part cannot be made, but its values can be checked
                _check_value(fields[key], value)
        except SolidsphError as cause:
            wrong.append(str(cause))
    if wrong:
        raise SceneError(f"{label}: {'; '.join(wrong)}")
    try:
        return cls(**parameters)
    except SolidsphError:
        raise
    except (TypeError, ValueError, OverflowError) as cause:
        raise SceneError(f"{label}: {cause}; check the values {parameters!r}") from cause
    except Exception as cause:
        raise PluginError(
            f"{label}: its constructor failed: {type(cause).__name__}: {cause}"
        ) from cause


def _check_value(field: attrs.Attribute[Any], value: object) -> None:
    """Check a value by itself, without the checks of the whole part.

    Raises:
        SceneError: it is of the wrong type.
    """
    if getattr(field.converter, "converter", None) is as_number:
        try:
            as_number(value, field)
        except (TypeError, ValueError, OverflowError) as cause:
            raise SceneError(str(cause)) from None


def describe(kind: str, part: object) -> dict[str, Any]:
    """The table that `construct` would turn into `part`.

    Raises:
        SceneError: it holds something that a file cannot hold, such as a Python function, or its
            class is not registered.
    """
    entry = registry.entry_of(kind, part)
    if not entry.name:
        raise SceneError(
            f"{registry.singular(kind)} {part!r} has no registered name, so it cannot be "
            f"written to a file; register {entry.target} under {registry.PREFIX}{kind}"
        )
    table: dict[str, Any] = {"type": entry.name}
    for name, field in _fields(type(part), entry.name).items():
        value = getattr(part, field.name)
        if value is None:
            continue
        nested = field.metadata.get("part")
        table[name] = (
            _plain(value, f"{entry.name}.{name}") if nested is None else _described(nested, value)
        )
    return table


def _fields(cls: type[Any], label: str) -> dict[str, attrs.Attribute[Any]]:
    if not attrs.has(cls):
        raise PluginError(
            f"{label}: {cls.__qualname__} is not an attrs class; decorate it with attrs.frozen"
        )
    return {field.alias or field.name: field for field in attrs.fields(cls) if field.init}


def _nested(kind: str, value: object, several: object, label: str) -> Any:
    if isinstance(value, (list, tuple)):
        # Annotations are text; a field of several parts is a tuple or a sequence of them.
        if not re.search(r"tuple|Sequence", str(several)):
            raise SceneError(f"{label} must be one {registry.singular(kind)}, got {value!r}")
        return tuple(construct(kind, item) for item in value)
    if isinstance(value, Mapping) and "type" not in value and _holds_parts(value, kind):
        return {name: construct(kind, item) for name, item in value.items()}
    return construct(kind, value)


def _holds_parts(value: Mapping[Any, Any], kind: str) -> bool:
    """Whether a table is one of several parts by name."""
    expected = registry.interface(kind)
    return bool(value) and all(
        isinstance(item, expected) or (isinstance(item, Mapping) and "type" in item)
        for item in value.values()
    )


def _described(kind: str, value: object) -> Any:
    if isinstance(value, (list, tuple)):
        return [describe(kind, item) for item in value]
    return describe(kind, value)


def _plain(value: Any, what: str) -> Any:
    """A value as TOML's numbers, text, lists and tables."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(k): _plain(v, f"{what}.{k}") for k, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(v, what) for v in value]
    raise SceneError(
        f"{what} = {value!r} cannot be written to a file; state it as a number or formula"
    )
