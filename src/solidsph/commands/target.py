"""Target of a verb: a scene file, or a case by name."""

from __future__ import annotations

import difflib
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import attrs
import click
from click.shell_completion import CompletionItem

from solidsph.errors import SceneError
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.scene.scene import Scene
from solidsph.scene.toml_reader import MOST_BYTES, similar_names
from solidsph.studies.case import Case
from solidsph.studies.scene_words import WORDS, changed, is_word
from solidsph.studies.variant import with_settings
from solidsph.system.encoding import decoded

STANDARD_INPUT = "-"


def resolve(target: str, settings: Sequence[str]) -> Scene | Case:
    """Scene from a path or the standard input, or case from its name and `name=value` settings.

    Raises:
        SceneError: there is no such file or case, or a setting is wrong.
    """
    path = Path(target)
    cases = registry.names("cases")
    is_case = target in cases and not path.is_file()
    if not is_case and (target == STANDARD_INPUT or target.endswith(".toml") or path.exists()):
        scene = _from_standard_input() if target == STANDARD_INPUT else Scene.read(path)
        for name, value in parameters(settings).items():
            if not is_word(name):
                near = difflib.get_close_matches(name, WORDS, 1)
                hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(WORDS)}"
                raise SceneError(
                    f"--set {name}: no such word of a scene; {hint}; or a key of its file, such as "
                    "body.NAME.spacing"
                )
            scene = changed(scene, name, value)
        return scene
    if target not in cases:
        what = "no file" if "/" in target or "." in target else "unknown case"
        hint = similar_names(target, *cases) or "; give a scene file, or a case: solidsph cases"
        raise SceneError(f"{what} {target!r}{hint}")
    own = [field.name for field in attrs.fields(registry.load("cases", target))]
    table = parameters(settings)
    words = {
        name: value
        for name, value in table.items()
        if name not in own and (name in WORDS or "." in name)
    }
    rest = {name: value for name, value in table.items() if name not in words}
    case: Case = construct("cases", {"type": target, **rest})
    return with_settings(case, words)


def target_argument() -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a verb whose argument is a scene or a case, with completion in the shell."""
    return click.argument("target", metavar="SCENE|-|CASE", shell_complete=_complete)


def _complete(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Cases by name, then files, which the shell completes by itself."""
    cases = [name for name in registry.names("cases") if name.startswith(incomplete)]
    return [*map(CompletionItem, cases), CompletionItem(incomplete, type="file")]


def name_of(target: str) -> str:
    """Name for the results of a target."""
    return "standard-input" if target == STANDARD_INPUT else Path(target).stem


def _from_standard_input() -> Scene:
    origin = "the standard input"
    data = sys.stdin.buffer.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise SceneError(f"{origin} is longer than {MOST_BYTES:,} bytes, the limit for a scene")
    try:
        return Scene.from_toml(decoded(data), origin)
    except ValueError as cause:
        raise SceneError(f"{origin} cannot be read: {cause}") from None


def parameters(settings: Sequence[str]) -> dict[str, Any]:
    """`name=value` settings as a table. Values are TOML, or else plain text.

    Raises:
        SceneError: a setting has no name or no equals sign.
    """
    table: dict[str, Any] = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals or not name.strip():
            raise SceneError(f"--set {setting!r} is not of the form name=value")
        try:
            parsed = tomllib.loads(f"value = {value}")
        except tomllib.TOMLDecodeError:
            parsed = {"value": value}
        table[name.strip()] = parsed["value"] if set(parsed) == {"value"} else value
    return table
