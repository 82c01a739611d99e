"""Rooms: which one may import which. Data flow one way, from the top of this list to its end."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src"

MAY_IMPORT = {
    "errors": "",
    "system": "",
    "maths": "errors",
    "model": "errors maths",
    "interfaces": "errors maths model",
    "registry": "errors",
    "engines": "errors system maths model interfaces",
    "probes": "errors maths model interfaces",
    "scene": "errors system maths model interfaces registry probes",
    "run": "errors system maths model interfaces registry probes scene",
    "statics": "errors maths model interfaces engines scene run",
    "results": "errors system maths model interfaces registry probes scene run",
    "watch": "errors maths model interfaces scene run statics",
    "advice": "maths model interfaces registry scene run",
    "conformance": "errors maths model interfaces registry run",
    "assembly": "errors system maths model interfaces registry engines probes scene run results "
    "advice conformance",
    "simulation": "errors interfaces scene run statics results watch assembly",
    "resumption": "errors system scene run results simulation",
    "costs": "errors system maths interfaces registry engines scene run simulation",
    "studies": "errors system maths model interfaces registry scene run results conformance "
    "simulation costs",
    "testing": "errors maths interfaces registry engines run statics conformance assembly "
    "simulation",
    "commands": "errors system interfaces registry scene run statics results watch advice "
    "conformance simulation resumption costs studies testing",
    "cli": "errors commands",
}
"""What a room may import; a file at the top is a room of its own. The faces of the package,
`solidsph` for users and `solidsph.parts` for authors, may import all; nothing imports them."""


def imports(path: Path) -> Iterator[str]:
    """Names of the modules that a file imports, also lazily or for type checking only."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def module_of(path: Path) -> str:
    parts = path.relative_to(SRC).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_of(path): path for path in sorted((SRC / "solidsph").rglob("*.py"))}
FACES = {"solidsph", "solidsph.__main__", "solidsph.parts"}


def dependencies(module: str) -> Iterator[str]:
    """Modules of the core that a module imports."""
    for name in imports(FILES[module]):
        while name and name not in FILES:
            name = name.rpartition(".")[0]
        if name and name != module:
            yield name


def room(module: str) -> str:
    return module.split(".")[1]


def test_the_list_is_the_tree() -> None:
    assert {room(module) for module in FILES if module not in FACES} == set(MAY_IMPORT)


def test_the_list_runs_one_way() -> None:
    above: set[str] = set()
    for name, allowed in MAY_IMPORT.items():
        assert set(allowed.split()) <= above, f"{name} may import what stands below it"
        above.add(name)


@pytest.mark.parametrize("name", MAY_IMPORT)
def test_a_room_imports_only_what_it_may(name: str) -> None:
    wrong, used = [], set()
    for module in FILES:
        if module in FACES or room(module) != name:
            continue
        for other in dependencies(module):
            if other in FACES:
                wrong.append(f"{module} imports a face of the package; name the module")
            elif room(other) != name:
                used.add(room(other))
                if room(other) not in MAY_IMPORT[name].split():
                    wrong.append(f"{module} imports {other}")
    assert wrong == []
    assert used == set(MAY_IMPORT[name].split()), f"{name} no longer needs all that it may import"


def test_no_import_runs_in_a_circle() -> None:
    """Between files, lazy imports and those for type checking included."""
    try:
        list(TopologicalSorter({one: set(dependencies(one)) for one in FILES}).static_order())
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))
