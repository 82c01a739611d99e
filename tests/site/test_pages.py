"""Pages of the documentation: all are in its contents, and what they link to is there."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import pytest

import solidsph
import solidsph.parts
import solidsph.statics
import solidsph.testing
from solidsph.registry import registry
from tests.site.contents import (
    DOCS,
    PAGES,
    ROOT,
    TUTORIALS,
    anchors,
    cells,
    links,
    reached,
)

REFERENCE = DOCS / "reference"


def test_every_page_is_in_the_contents() -> None:
    pages = {page.relative_to(DOCS).with_suffix("").as_posix() for page in DOCS.rglob("*.md")}
    assert reached() == pages


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_its_links_lead_somewhere(page: Path) -> None:
    assert [link for link in links(page) if not _leads_somewhere(page, link)] == []


def _leads_somewhere(page: Path, link: str) -> bool:
    if "://" in link or link.startswith("mailto:"):
        return True  # `make docs-links` asks them
    file, _, anchor = link.partition("#")
    if not file and anchor.startswith("solidsph"):
        return _is_python(anchor)
    target = (page.parent / file) if file else page
    return target.exists() and (not anchor or anchor in anchors(target))


def _is_python(name: str) -> bool:
    """Whether a dotted name is a module, or what is in one."""
    words = name.split(".")
    for length in range(len(words), 0, -1):
        try:
            found: object = import_module(".".join(words[:length]))
        except ModuleNotFoundError:
            continue
        for word in words[length:]:
            if not hasattr(found, word):
                return False
            found = getattr(found, word)
        return True
    return False


def test_a_dead_link_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Here\n[a](there.md) [b](#here) [c](#nowhere) [d](#solidsph.Nothing)\n")
    dead = [link for link in links(page) if not _leads_somewhere(page, link)]
    assert dead == ["there.md", "#nowhere", "#solidsph.Nothing"]


def _documented() -> set[str]:
    """Dotted names that the reference has an entry for."""
    names: set[str] = set()
    for page in REFERENCE.glob("*.md"):
        module = ""
        text = page.read_text(encoding="utf-8")
        for directive, given in re.findall(r"^\.\. ([\w:]+):: (\S+)", text, flags=re.MULTILINE):
            name = given.partition("(")[0]
            if directive == "currentmodule":
                module = name
            elif directive == "automodule":
                names |= {f"{name}.{one}" for one in import_module(name).__all__}
            else:
                names.add(name if "." in name else f"{module}.{name}")
    return names


def test_every_public_name_has_an_entry() -> None:
    known = {name.rpartition(".")[2] for name in _documented()}
    for module in (solidsph, solidsph.parts, solidsph.statics, solidsph.testing):
        assert [name for name in module.__all__ if name not in known] == []
    assert [name for name in solidsph.__all__ if f"solidsph.{name}" not in _documented()] == []


def test_every_entry_is_there() -> None:
    assert [name for name in _documented() if not _is_python(name)] == []


def test_every_kind_of_part_has_a_section() -> None:
    text = (REFERENCE / "built-in.md").read_text(encoding="utf-8")
    kinds = re.findall(r"```\{registered-parts\} (\S+)", text)
    assert sorted(kinds) == sorted(registry.INTERFACES)


def _code(page: Path) -> Sequence[ast.AST]:
    return [node for cell in cells(page) for node in ast.walk(ast.parse(cell))]


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_checks_what_it_says(page: Path) -> None:
    """It asserts, and takes names from places that are documented."""
    code = _code(page)
    assert any(isinstance(node, ast.Assert) for node in code)
    known = {name.rpartition(".")[2] for name in _documented()}
    imported = {
        name.name
        for node in code
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("solidsph")
        for name in node.names
    }
    assert imported <= known


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_names_nothing_of_the_scheme(page: Path) -> None:
    called = {node.attr for node in _code(page) if isinstance(node, ast.Attribute)}
    own = {"kernel"} if page.stem == "own-kernel" else set()
    scheme = {"scheme", "kernel", "formulation", "integrator", "engine"}
    assert called & scheme == own


def test_the_readme_shows_a_picture_at_once() -> None:
    first = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:12]
    (picture,) = re.findall(r"!\[[^]]+\]\(([^)]+)\)", "\n".join(first))
    assert (ROOT / picture).stat().st_size <= 150_000
