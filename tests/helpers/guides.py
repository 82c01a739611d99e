"""The pages for authors of parts, taken apart: their modules, entry points, scenes and tests."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import attrs

DOCS = Path(__file__).parents[2] / "docs"

# A page that builds on the distribution of another.
_NEEDS = {"first-history-material": ("first-material",)}

Install = Callable[[str, str, str, str], None]
"""The fixture `foreign`: distribution, module, source and entry points."""


@attrs.frozen
class Guide:
    """One page. Its part is a module, a table of entry points and a piece of a scene."""

    name: str
    modules: Mapping[str, str]  # the source of every module
    points: Mapping[str, Mapping[str, str]]  # group -> name -> target
    scenes: tuple[Mapping[str, Any], ...]  # the pieces of scenes
    test: str

    @classmethod
    def read(cls, name: str) -> Guide:
        text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
        code, tables = _blocks(text, "python"), [tomllib.loads(t) for t in _blocks(text, "toml")]
        sources = [one for one in code if "\ndef test_" not in one]
        (test,) = [one for one in code if "\ndef test_" in one]
        groups = [one["project"]["entry-points"] for one in tables if "project" in one]
        points: dict[str, dict[str, str]] = {}
        modules = {}
        for source, group in zip(sources, groups, strict=True):
            ((kind, entries),) = group.items()
            points.setdefault(kind, {}).update(entries)
            (target,) = entries.values()
            modules[target.partition(":")[0]] = source
        scenes = tuple(one for one in tables if "project" not in one)
        return cls(name, modules, points, scenes, test)

    def install(self, foreign: Install) -> None:
        """As distributions of one module each, by the fixture of that name."""
        for other in _NEEDS.get(self.name, ()):
            Guide.read(other).install(foreign)
        for kind, entries in self.points.items():
            for name, target in entries.items():
                module = target.partition(":")[0]
                points = f"[{kind}]\n{name} = {target}"
                foreign(f"guide-{name}", module, self.modules[module], points)


def _blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)
