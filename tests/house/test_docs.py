"""The documentation shows code that is run, and lists what there is."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from solidsph import Scene, Simulation, solve
from solidsph.registry import registry
from tests.helpers.scenes import box

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EXAMPLE = ROOT / "plugins/examples/solidsph-wendland"


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / page).read_text()
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_first_kernel_shows_the_example_plugin() -> None:
    kernel, tests = blocks("docs/first-kernel.md", "python")
    assert kernel == (EXAMPLE / "src/solidsph_wendland/wendland_c2.py").read_text()
    assert tests == (EXAMPLE / "tests/test_wendland_c2.py").read_text()
    shown = tomllib.loads(blocks("docs/first-kernel.md", "toml")[0])
    real = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())
    assert shown["project"]["entry-points"] == real["project"]["entry-points"]


def test_the_scenes_shown_can_be_built_and_the_static_one_run() -> None:
    moving, static, _ = (Scene.from_toml(text) for text in blocks("docs/scenes.md", "toml"))
    assert Simulation.builder(moving).build().steps > 0
    assert solve(Simulation.builder(static).build()).effort["residual [-]"] < 1e-9


def test_the_probes_shown_measure_what_is_said(tmp_path, monkeypatch) -> None:
    (code,) = blocks("docs/scenes.md", "python")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cantilever.toml").write_text(blocks("docs/scenes.md", "toml")[-1])
    names: dict[str, Any] = {}
    exec(compile(code, "docs/scenes.md", "exec"), names)
    final = names["result"].final
    assert final["root force y [N]"] == pytest.approx(1.0, abs=5e-7)
    assert final["root moment z [N m]"] == pytest.approx(0.5, abs=5e-6)
    assert final["top fibre maximum at X [m]"] == 0.1
    above = final["top fibre maximum stress xx [Pa]"] / 240.0 - 1.0
    assert above == pytest.approx(1.4e-3, abs=5e-5)
    assert names["moments"][-1] == final["root moment z [N m]"]
    # The profile is that of bending, and the values are those of the probe.
    assert names["profile"][[0, -1]] == pytest.approx([-150.0, 150.0], rel=0.01)
    assert names["values"].displacement[0, 1] == pytest.approx(final["tip displacement y [m]"])


def test_the_particles_of_a_tag_are_found_as_is_said(tmp_path, monkeypatch) -> None:
    (code,) = blocks("docs/running.md", "python")
    monkeypatch.chdir(tmp_path)
    built = box(2, tags={"near": "X < 0.3", "low": "Y < 0.4"}).build()
    built.run(record="plate.vtkhdf")
    names: dict[str, Any] = {}
    exec(compile(code, "docs/running.md", "exec"), names)
    X = built.particles.positions[built.particles.tags["low"]]
    assert 0 < len(X) < built.particles.count
    assert names["low"].points[:, :2] == pytest.approx(X)


def test_the_scenes_shown_are_sound() -> None:
    from solidsph.advice import advise

    for text in blocks("docs/scenes.md", "toml"):
        built = Simulation.builder(Scene.from_toml(text)).build()
        assert [one.line for one in advise(built)] == []


def test_every_builtin_part_is_listed() -> None:
    text = (ROOT / "docs/scenes.md").read_text()
    missing = [
        entry.name
        for kind in registry.INTERFACES
        for entry in registry.available(kind)
        if entry.distribution == "solidsph" and f"`{entry.name}`" not in text
    ]
    assert missing == []


def test_the_readmes_python_runs(tmp_path, monkeypatch) -> None:
    (code,) = blocks("README.md", "python")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert (tmp_path / "results/plate/record.h5").exists()


def test_what_the_reading_of_the_paper_names_is_there() -> None:
    text = (ROOT / "docs/reading-the-paper.md").read_text()
    folder = ROOT
    for name in re.findall(r"`([\w/.-]+\.py)`", text):
        path = ROOT / name if "/" in name else folder / name
        assert path.exists(), name
        folder = path.parent  # a name without a folder is beside the one before
    cases = re.findall(r"the case `([\w-]+)`|solidsph run ([\w-]+)", text)
    assert cases
    assert {one or other for one, other in cases} <= set(registry.names("cases"))


def test_every_verb_is_in_the_readme() -> None:
    from solidsph.cli import VERBS

    text = (ROOT / "README.md").read_text()
    assert all(f"solidsph {verb}" in text for verb in VERBS)


def test_every_module_of_the_core_is_in_the_architecture() -> None:
    text = (ROOT / "docs/architecture.md").read_text()
    core = ROOT / "src/solidsph"
    named = [path.name for path in core.glob("*.py") if not path.name.startswith("__")]
    folders = [f"{path.name}/" for path in core.iterdir() if (path / "__init__.py").exists()]
    small = {"arrays.py", "errors.py", "problems.py"}
    assert [name for name in [*named, *folders] if name not in text and name not in small] == []


def test_every_warning_is_listed() -> None:
    from solidsph.advice import ADVICE

    text = (ROOT / "docs/scenes.md").read_text()
    assert [name for name in ADVICE if f"`{name}`" not in text] == []


def test_every_page_is_in_the_index() -> None:
    """Where people read on GitHub, which shows no contents beside a page."""
    folders = (DOCS, DOCS / "decisions")
    pages = [page for folder in folders for page in sorted(folder.glob("*.md"))]
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    elsewhere = {"index", "changelog", "contributing"}
    names = [str(page.relative_to(DOCS)) for page in pages if page.stem not in elsewhere]
    assert [name for name in names if f"({name})" not in text] == []


@pytest.mark.parametrize(
    "page",
    [
        "CONTRIBUTING.md",
        "docs/authors.md",
        *sorted(f"docs/decisions/{page.name}" for page in (DOCS / "decisions").glob("*.md")),
    ],
)
def test_files_that_a_page_names_are_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"`((?:src|plugins|tests|docs|benchmarks)/[\w/.-]+)`", text)
    # A word in capitals stands for any name.
    files = [one for one in named if not re.search(r"/[A-Z]+", one)]
    assert [one for one in files if not (ROOT / one).exists()] == []


def test_the_scene_and_the_calls_of_the_page_on_accuracy(tmp_path, monkeypatch, capsys) -> None:
    scene, reference = blocks("docs/accuracy.md", "toml")
    assert Scene.from_toml(scene + reference).references
    (code,) = blocks("docs/accuracy.md", "python")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cantilever.toml").write_text(scene)
    names: dict[str, Any] = {}
    exec(compile(code, "docs/accuracy.md", "exec"), names)
    assert "1 % takes" in capsys.readouterr().out
    # What the page says of the tip, to its three digits.
    assert names["made"].limits[0].value == pytest.approx(-4.67e-4, rel=2e-3)
    assert names["found"].point.error <= 0.01


def test_getting_started_goes_as_it_says(tmp_path, monkeypatch, capsys) -> None:
    (scene,) = blocks("docs/getting-started.md", "toml")
    (code,) = blocks("docs/getting-started.md", "python")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hole.toml").write_text(scene)
    exec(compile(code, "docs/getting-started.md", "exec"), {})
    # The page says 0.452 m.
    assert float(capsys.readouterr().out) == pytest.approx(0.452, abs=5e-4)
    assert (tmp_path / "hole.png").exists()
