"""Keys of a scene file, such as `body.plate.spacing`, to change one value of a scene."""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from typing import Any

from solidsph.errors import SceneError
from solidsph.scene.scene import Scene
from solidsph.scene.toml_reader import SCALARS, SECTIONS

# Sections that are lists; an entry is named by its label or its type, or by what it has instead.
_LISTS = tuple(name for name, shown in SECTIONS.items() if shown.startswith("[["))
_NAMED_BY = {"initial": ("where",), "reference": ("quantity",)}


def is_key(name: str) -> bool:
    """Whether `name` is a value at the top of a scene file, or goes on after a section."""
    section, dot, rest = name.partition(".")
    return name in SCALARS or bool(dot and rest and section in SECTIONS)


def with_key(scene: Scene, key: str, value: Any) -> Scene:
    """`scene` with another value at a key of its file.

    Args:
        scene: one that can be written to a file.
        key: names joined by dots, as in `body.plate.spacing` or `integrator.time_step_factor`. An
            entry of a list is named by its label or its type: `effect.artificial-viscosity.linear`;
            an initial state by its place, `initial.all.velocity`, a reference by its quantity.
        value: as it would stand in the file.

    Raises:
        SceneError: there is no such place, or the scene that results has mistakes.
    """
    table: dict[str, Any] = tomllib.loads(scene.to_toml())
    *path, last = key.split(".")
    place: Any = table
    for depth, name in enumerate(path):
        here = ".".join(path[:depth])
        place = _entry(place, name, here) if here in _LISTS else _table(place, name, here)
    if not isinstance(place, dict):
        raise SceneError(f"{key!r}: {'.'.join(path)} is {place!r}, which has no keys")
    place[last] = value
    import tomli_w  # only where a scene is changed

    try:
        return Scene.from_toml(tomli_w.dumps(table), f"the scene with {key} = {value!r}")
    except TypeError as cause:
        raise SceneError(f"{key} = {value!r} cannot stand in a scene file: {cause}") from None


def value_at(scene: Scene, key: str) -> Any:
    """Value at a key of the file of a scene.

    Raises:
        SceneError: there is none.
    """
    place: Any = tomllib.loads(scene.to_toml())
    path = key.split(".")
    for depth, name in enumerate(path):
        here = ".".join(path[:depth])
        if here in _LISTS:
            place = _entry(place, name, here)
        elif isinstance(place, dict) and name in place:
            place = place[name]
        else:
            raise SceneError(f"the scene says nothing of {key!r}")
    return place


def _table(place: Any, name: str, here: str) -> Any:
    """The table of that name; a part that stands there by its name alone becomes one."""
    if not isinstance(place, dict):
        raise SceneError(f"{here} is {place!r}, which has no keys")
    if here == "body" and name not in place:
        raise SceneError(f"there is no body {name!r}{_hint(name, list(place))}")
    found = place.setdefault(name, [] if not here and name in _LISTS else {})
    if isinstance(found, str):
        found = place[name] = {"type": found}
    return found


def _entry(entries: Any, name: str, section: str) -> dict[str, Any]:
    """The entry of a list with this label, or else with this type."""
    for number, entry in enumerate(entries):
        if isinstance(entry, str):
            entries[number] = {"type": entry}
    words = _NAMED_BY.get(section, ("label", "type"))
    for word in words:
        found = [entry for entry in entries if entry.get(word) == name]
        if len(found) > 1:
            raise SceneError(
                f"{len(found)} entries of [[{section}]] have the {word} {name!r}; give the one "
                "that is meant a label, and write that"
            )
        if found:
            one: dict[str, Any] = found[0]
            return one
    known = [next((entry[word] for word in words if word in entry), "") for entry in entries]
    which = " or ".join(words)
    raise SceneError(f"no [[{section}]] has the {which} {name!r}{_hint(name, known)}")


def _hint(name: str, known: list[str]) -> str:
    near = get_close_matches(name, known, 1)
    return f"; did you mean {near[0]!r}?" if near else f"; there are: {', '.join(known) or 'none'}"
