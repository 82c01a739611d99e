"""The house rules that a program can check."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from solidsph.registry import registry
from tests.helpers.scenes import SCENE_TOML

ROOT = Path(__file__).parents[2]


def modules_after(code: str) -> set[str]:
    """Modules loaded in a fresh interpreter after running `code`."""
    script = f"{code}\nimport sys, json; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_core_imports_nothing_from_plugins() -> None:
    every_module = [
        "solidsph." + ".".join(path.relative_to(ROOT / "src/solidsph").with_suffix("").parts)
        for path in sorted((ROOT / "src/solidsph").rglob("*.py"))
        if path.stem != "__init__"
    ]
    assert len(every_module) > 30
    loaded = modules_after("\n".join(f"import {name}" for name in every_module))
    assert not {name for name in loaded if name.startswith("solidsph_builtin")}


def test_core_never_names_the_builtin_package() -> None:
    named = [
        str(path)
        for path in (ROOT / "src/solidsph").rglob("*.py")
        if "solidsph_builtin" in path.read_text()
    ]
    assert named == []


def test_listing_plugins_imports_none_of_them() -> None:
    loaded = modules_after(
        "from solidsph.registry import registry\n"
        "found = [registry.available(kind) for kind in registry.INTERFACES]\n"
        "assert all(found)"
    )
    assert not {name for name in loaded if name.startswith("solidsph_builtin")}


def test_loading_cases_loads_no_matplotlib() -> None:
    loaded = modules_after(
        "from solidsph.registry import registry\n"
        "assert [registry.load('cases', name) for name in registry.names('cases')]"
    )
    assert "solidsph_cases.drawing.sheet" in loaded
    assert not {name for name in loaded if name.startswith("matplotlib")}


def test_installed_entry_points_are_those_of_pyproject() -> None:
    """An edited entry point has no effect until the package is installed again."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    for group, points in declared.items():
        installed = {
            point.name: point.value
            for point in entry_points(group=group)
            if point.dist is not None and point.dist.name == "solidsph"
        }
        assert installed == points, f"{group} differs: re-run pip install -e ."


def test_every_group_of_pyproject_is_known() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    assert set(declared) == {registry.PREFIX + kind for kind in registry.INTERFACES}


def test_implementations_do_not_inherit_from_each_other() -> None:
    for kind in registry.INTERFACES:
        for name in registry.names(kind):
            (base,) = registry.load(kind, name).__bases__
            assert issubclass(base, registry.interface(kind)), f"{name}: {base}"
            room = "solidsph.studies.case" if kind == "cases" else "solidsph.interfaces."
            assert base.__module__.startswith(room), f"{name}: {base}"


def test_a_scene_without_effects_loads_none() -> None:
    loaded = modules_after(
        "from solidsph import Scene, Simulation\n"
        f"scene = Scene.from_toml({SCENE_TOML!r})\n"
        "Simulation.builder(scene).build().run()"
    )
    builtin = {name for name in loaded if name.startswith("solidsph_builtin")}
    assert builtin, "the run used no built-in part at all"
    assert not {name for name in builtin if name.startswith("solidsph_builtin.effects.")}
    # Nor any part of another kind that the scene does not name.
    kernels = {name for name in builtin if name.startswith("solidsph_builtin.kernels.")}
    assert kernels == {"solidsph_builtin.kernels.modified_mollifier"}
    assert not {name for name in loaded if name.startswith(("matplotlib", "rich", "vtk"))}


@pytest.mark.parametrize("folder", ["src", "plugins"])
def test_every_module_says_what_it_is(folder: str) -> None:
    silent = [
        str(path.relative_to(ROOT))
        for path in (ROOT / folder).rglob("*.py")
        if path.stem != "__init__" and not re.match(r'(#!.*\n)?r?"""', path.read_text())
    ]
    assert silent == []
