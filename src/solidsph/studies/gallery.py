"""Gallery: a page of the measurements of cases, with their pictures."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from solidsph.registry import registry
from solidsph.studies.case_run import CaseResult
from solidsph.studies.reproduce import Reproduction

_COLOURS = 128


def write_gallery(made: Reproduction, page: Path) -> None:
    """Write a Markdown `page`, its pictures in a folder of the same name beside it."""
    pictures = page.with_suffix("")
    pictures.mkdir(parents=True, exist_ok=True)
    for old in pictures.glob("*.png"):
        old.unlink()
    parts = [
        "# Gallery\n\nThe figures of Ismail & Reddy, *Smoothed Particle Hydrodynamics for "
        "Nonlinear Solid Mechanics*, as `solidsph reproduce` makes them, beside what theory says. "
        "Written by `make gallery`; nothing here is edited by hand.\n"
    ]
    for name, result in made.results.items():
        parts.append(_section(name, result, pictures))
    page.write_text("\n".join(parts), encoding="utf-8")


def _section(name: str, result: CaseResult, pictures: Path) -> str:
    case = registry.load("cases", name)
    lines = [f"## {case.title}", "", f"{case.source}. `solidsph run {name}`", ""]
    for path in result.pictures:
        write_small_copy(path, pictures / path.name)
        lines += [f"![{path.stem}]({pictures.name}/{path.name})", ""]
    lines += [
        "| quantity | the paper | theory | measured | unit | error |",
        "| --- | --- | ---: | ---: | --- | ---: |",
    ]
    for m in result.measurements:
        theory = "" if m.reference is None else f"{m.reference:.5g}"
        error = "" if m.error is None else f"{100.0 * m.error:.2g} %"
        cells = (m.quantity, m.paper, theory, f"{m.value:.5g}", m.unit, error)
        lines.append("| " + " | ".join(map(_cell, cells)) + " |")
    return "\n".join([*lines, ""])


def _cell(text: str) -> str:
    """`text` for a table of Markdown, where "<f>" would be an HTML tag."""
    return text.replace("|", "\\|").replace("<", "&lt;")


def write_small_copy(picture: Path, path: Path) -> None:
    """Write a copy in few colours, a third of the size, for pages kept beside the code."""
    with Image.open(picture) as image:
        image.convert("RGB").quantize(_COLOURS).save(path, optimize=True)
