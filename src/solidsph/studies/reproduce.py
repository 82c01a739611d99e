"""Reproduction of a paper: the cases that show its figures, and all pictures on one sheet."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path

import attrs
from matplotlib.figure import Figure
from matplotlib.image import imread

from solidsph.errors import SceneError
from solidsph.registry import registry
from solidsph.studies.case import Case
from solidsph.studies.case_run import Begin, CaseResult, run_case

_COLUMNS = 3  # of the contact sheet


@attrs.frozen
class Reproduction:
    """Results of the cases that reproduce the chosen figures."""

    results: Mapping[str, CaseResult]  # by case
    pictures: Sequence[Path]  # of these figures, in their order
    sheet: Path | None  # all of them in one picture; None if there are none

    @property
    def passed(self) -> bool:
        """Whether every measurement is as its source predicts."""
        return all(result.passed for result in self.results.values())


def figures() -> Mapping[str, str]:
    """Case that reproduces each figure or passage of the paper, figures first.

    Raises:
        SceneError: two cases claim one figure.
    """
    cases: dict[str, str] = {}
    for name in registry.names("cases"):
        for figure in registry.load("cases", name).figures:
            if figure in cases:
                raise SceneError(
                    f"cases {cases[figure]!r} and {name!r} both reproduce {figure!r}; uninstall one"
                )
            cases[figure] = name
    return dict(sorted(cases.items(), key=lambda pair: _place(pair[0])))


def reproduce(wanted: Sequence[str], folder: Path, begin: Begin) -> Reproduction:
    """Run every case that shows one of the `wanted` figures, by default all.

    Args:
        wanted: names of figures or passages, such as "fig-11" or "section-6-viscosity".
        folder: for a folder of each case.
        begin: as in `run_case`.

    Raises:
        SceneError: no case reproduces such a figure.
    """
    known = figures()
    for figure in wanted:
        if figure not in known:
            near = difflib.get_close_matches(figure, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(f"no case reproduces {figure!r}; {hint}")
    chosen = wanted or list(known)
    results = {}
    for name in dict.fromkeys(known[figure] for figure in chosen):
        case: Case = registry.load("cases", name)()
        results[name] = run_case(case, folder / name, begin=begin)
    every = [path for result in results.values() for path in result.pictures]
    shown = {path: names for path in every if (names := _shown(path, chosen))}
    pictures = sorted(shown, key=lambda path: (min(map(_place, shown[path])), path.name))
    return Reproduction(results, pictures, _contact_sheet(pictures, folder) if pictures else None)


def _place(name: str) -> tuple[bool, int, str]:
    """Figures by their number, then the rest by name."""
    figure = re.fullmatch(r"fig-(\d+)", name)
    return figure is None, int(figure[1]) if figure else 0, name


def _shown(path: Path, chosen: Sequence[str]) -> set[str]:
    """Those of the chosen that a picture shows: "fig-13-14-map.png" shows two figures."""
    figures = re.match(r"fig((?:-\d+)+)(?:-|$)", path.stem)
    if figures:
        return {f"fig-{number}" for number in figures[1].split("-")[1:]} & set(chosen)
    return {name for name in chosen if f"{path.stem}-".startswith(f"{name}-")}


def _contact_sheet(pictures: Sequence[Path], folder: Path) -> Path:
    rows = ceil(len(pictures) / _COLUMNS)
    columns = min(_COLUMNS, len(pictures))
    sheet = Figure(figsize=(7.0 * columns, 5.0 * rows), layout="constrained")
    axes = sheet.subplots(rows, columns, squeeze=False).ravel()
    for axis in axes:
        axis.set_axis_off()
    for axis, path in zip(axes, pictures, strict=False):
        axis.imshow(imread(path))
        axis.set_title(path.stem, fontsize=12)
    path = folder / "contact-sheet.png"
    sheet.savefig(path, dpi=100)
    return path
