"""What the sums of SPH make of a falling edge, from a gentle slope to a jump."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases._compare import closed_form
from solidsph_cases._line import LENGTH, Line, check_covers, complete_line
from solidsph_cases._moments import Moments, of_lattice
from solidsph_cases._scene import check_count
from solidsph_cases._slopes import SlopeOfEdge
from solidsph_cases.drawing.profiles import KEY, by_cover
from solidsph_cases.drawing.sheet import Mark, Panel, Sheet, theory

GRADIENTS = ("standard", "corrected")

_FIGURES = ("Fig. 6", "Fig. 7", "Fig. 8", "Fig. 9")

# What the paper says of each figure.
_PAPER = (
    "all cover sizes perform well, 1.5 spacings under-predict the gradient",
    "all of the cover sizes start to behave in a similar manner",
    "1.5 spacings rapidly start out-performing other cover sizes",
    "1.5 spacings approximate the gradient very well, others are significantly different",
)

_SUMS = "sums over an endless lattice"


@final
@attrs.frozen
class FallingEdge(Case):
    """A field that is 1 on the left, 0 on the right, and falls linearly over some spacings between.

    Its kinks are at particles, where its slope is the mean of both sides; over one spacing it is
    the square wave's jump as particles see it. Errors are roots of mean squares over the
    particles, relative to the same of the true slope.
    """

    title = "A falling edge, from a gentle slope to a jump"
    source = "Ismail & Reddy, section 3.1, Figs. 6 to 9"
    figures = ("fig-6", "fig-7", "fig-8", "fig-9")

    kernel: str = "modified-mollifier"
    covers: Sequence[float] = (1.5, 2.5, 3.5, 4.5, 5.5)  # [spacings]
    widths: Sequence[int] = (31, 15, 5, 1)  # of the edge, one a figure; odd [spacings]
    cells: int = 61  # spacings from 0 to 1; odd, so that the middle lies between two particles

    def __attrs_post_init__(self) -> None:
        check_covers("falling-edge", self.covers)
        check_count("falling-edge", "cells", self.cells, 3)
        if self.cells % 2 == 0:
            raise SceneError(f"case 'falling-edge': cells must be odd, got {self.cells}")
        if not isinstance(self.widths, (list, tuple)) or len(self.widths) != len(_FIGURES):
            raise SceneError(
                f"case 'falling-edge': widths must be {len(_FIGURES)} whole numbers, one for each "
                f"figure, got {self.widths!r}"
            )
        for width in self.widths:
            check_count("falling-edge", "a width", width, 1)
            if width % 2 == 0 or width > self.cells:
                raise SceneError(
                    f"case 'falling-edge': a width must be odd and at most cells = {self.cells}, "
                    f"got {width}; then the kinks are at particles"
                )

    def priced(self) -> Case:
        """One slope by one cover."""
        return SlopeOfEdge(kernel=self.kernel)

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        lines = {gradient: self.lines(gradient) for gradient in GRADIENTS}
        return [
            measurement
            for figure, width, says in zip(_FIGURES, self.widths, _PAPER, strict=True)
            for measurement in self._figure(figure, width, says, lines)
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Figs. 6 and 7, Figs. 8 and 9."""
        return {
            "fig-6-7-gentle-edges": self._sheet(_FIGURES[:2], self.widths[:2]),
            "fig-8-9-steep-edges": self._sheet(_FIGURES[2:], self.widths[2:]),
        }

    def _sheet(self, figures: Sequence[str], widths: Sequence[int]) -> Sheet:
        """A column a figure: the field, its plain and its corrected slope."""
        plain, corrected = (self.lines(gradient) for gradient in GRADIENTS)
        columns: list[Sequence[Panel]] = []
        for figure, width in zip(figures, widths, strict=True):
            kinds = (
                (plain, edge, lambda line, f: line.smoothing @ f, "f \\rangle$ [1]"),
                (plain, _slope, _spaced_gradient, "f' \\rangle$, plain gradient [1/ps]"),
                (corrected, _slope, _spaced_gradient, "f' \\rangle$, corrected gradient [1/ps]"),
            )
            columns.append(
                [
                    _panel(
                        *(lines, width, exact, approximation),
                        title=f"{figure}: edge over {width} spacing{'s' if width > 1 else ''}"
                        if exact is edge
                        else "",
                        x="distance from the middle [ps]",
                        y="" if columns else f"$\\langle {label}",
                        same_x=figure,
                    )
                    for lines, exact, approximation, label in kinds
                ]
            )
        rows = list(zip(*columns, strict=True))
        title = f"Falling edges ({self.kernel}); Ismail & Reddy, {' and '.join(figures)}"
        return Sheet(rows, (12.0, 10.0), title, key=columns[0][-1], key_style=KEY)

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        lines = {gradient: self.lines(gradient) for gradient in GRADIENTS}
        return {
            f"fig-{number}-edge-over-{width}-spacings": _table(lines, width)
            for number, width in enumerate(self.widths, start=6)
        }

    def lines(self, gradient: str) -> Mapping[float, Line]:
        """Particles with ghosts on either side, by cover."""
        return {
            cover: complete_line(self.kernel, cover, self.cells, gradient=gradient)
            for cover in self.covers
        }

    def _figure(
        self, figure: str, width: int, says: str, lines: Mapping[str, Mapping[float, Line]]
    ) -> Iterator[Measurement]:
        over = f"{figure}, edge over {width} spacing{'s' if width > 1 else ''}"
        plain, corrected = (lines[gradient] for gradient in GRADIENTS)
        yield from _slopes(f"{over}: error of the plain", plain, width, says, lambda moments: 1.0)
        yield from _slopes(
            f"{over}: error of the corrected",
            corrected,
            width,
            says,
            lambda moments: moments.slope[1],
        )
        for cover in dict.fromkeys((min(plain), max(plain))):
            line = plain[cover]
            one = line.smoothing @ np.ones(len(line.X))
            yield closed_form(
                f"{over}: steepness of <f> / <1> in its middle over the true one, cover {cover:g}",
                _steepness(line.smoothing @ edge(line, width) / one, width),
                _steepness(values_by_sums(line.kernel, line, width), width)
                / of_lattice(line.kernel, line.spacing).value[0],
                source=_SUMS,
                paper=says,
            )


def _slopes(
    what: str,
    lines: Mapping[float, Line],
    width: int,
    says: str,
    divisor: Callable[[Moments], float],
) -> Iterator[Measurement]:
    """Errors of the slope at the smallest and the largest cover, and at the best if another."""
    found, theory = {}, {}
    for cover, line in lines.items():
        sums = slopes_by_sums(line.kernel, line, width)
        sums /= divisor(of_lattice(line.kernel, line.spacing))
        found[cover] = slope_error(line, width, line.gradient @ edge(line, width))
        theory[cover] = slope_error(line, width, sums)
    ranked = sorted(found, key=found.__getitem__)
    for cover in dict.fromkeys((min(found), max(found), ranked[0])):
        yield attrs.evolve(
            closed_form(
                f"{what} slope, cover {cover:g}",
                found[cover],
                theory[cover],
                source=_SUMS,
                paper=says,
            ),
            verdict=f"number {ranked.index(cover) + 1} of {len(ranked)} covers",
        )


def _steepness(values: Array, width: int) -> float:
    """Of `values` (n,) between the two middle particles, over that of the edge [-]."""
    right = len(values) // 2
    return float((values[right - 1] - values[right]) * width)


def edge(line: Line, width: int) -> Array:
    """f at every particle (n,)."""
    return falling(line.X - 0.5 * LENGTH, width * line.spacing)


def falling(x: Array, width: float) -> Array:
    """1 on the left of an edge of this width [m] about x = 0, 0 on its right."""
    return np.clip(0.5 - x / width, 0.0, 1.0)


def true_slope(line: Line, width: int) -> Array:
    """f' at every particle (n,) [1/m], the mean of both sides at the two kinks."""
    # Particles lie at odd multiples of half a spacing, kinks too: a quarter tells them apart.
    away = np.abs(line.X - 0.5 * LENGTH) / line.spacing - 0.5 * width
    share = np.where(away < -0.25, 1.0, np.where(away > 0.25, 0.0, 0.5))
    result: Array = -share / (width * line.spacing)
    return result


def slope_error(line: Line, width: int, slope: Array) -> float:
    """Of a `slope` (n,) [1/m] at the particles from 0 to 1, relative [-]."""
    true = true_slope(line, width)[line.real]
    return float(np.linalg.norm(slope[line.real] - true) / np.linalg.norm(true))


def slopes_by_sums(kernel: SmoothingKernel, line: Line, width: int) -> Array:
    """The plain slope at every particle (n,), by neighbours at +-k spacings, k = 1, 2, ..."""
    slopes = np.zeros(len(line.X))
    for r, left, right in _neighbours(kernel, line, width):
        slopes -= line.spacing * float(kernel.slope(np.array([r]))[0]) * (right - left)
    return slopes


def values_by_sums(kernel: SmoothingKernel, line: Line, width: int) -> Array:
    """<f> at every particle (n,), in the same way."""
    values = line.spacing * float(kernel.value(np.zeros(1))[0]) * edge(line, width)
    for r, left, right in _neighbours(kernel, line, width):
        values += line.spacing * float(kernel.value(np.array([r]))[0]) * (right + left)
    return values


def _neighbours(
    kernel: SmoothingKernel, line: Line, width: int
) -> Iterator[tuple[float, Array, Array]]:
    """Each distance within the support [m], and f there on the left and on the right, (n,)."""
    x, dx = line.X - 0.5 * LENGTH, line.spacing
    for r in dx * np.arange(1.0, np.ceil(kernel.support_radius / dx)):
        yield float(r), falling(x - r, width * dx), falling(x + r, width * dx)


def _table(lines: Mapping[str, Mapping[float, Line]], width: int) -> Curves:
    """f, <f>, and its slopes at every particle of (0, 1), for every cover."""
    some = next(iter(lines["standard"].values()))
    real = some.real
    table = {
        "x [m]": some.X[real],
        "f exact [1]": edge(some, width)[real],
        "f' exact [1/m]": true_slope(some, width)[real],
    }
    for cover, line in lines["standard"].items():
        table[f"f cover {cover:g} [1]"] = (line.smoothing @ edge(line, width))[line.real]
    for gradient, covers in lines.items():
        for cover, line in covers.items():
            slope = (line.gradient @ edge(line, width))[line.real]
            table[f"f' {gradient} cover {cover:g} [1/m]"] = slope
    return table


def _slope(line: Line, width: int) -> Array:
    return line.spacing * true_slope(line, width)


def _spaced_gradient(line: Line, f: Array) -> Array:
    return np.asarray(line.spacing * (line.gradient @ f))


def _panel(
    lines: Mapping[float, Line],
    width: int,
    exact: Callable[[Line, int], Array],
    approximation: Callable[[Line, Array], Array],
    **options: Any,
) -> Panel:
    """Near the edge: exact values at the particles, and the approximations of every cover."""
    curves = {}
    marks: list[Mark] = []
    for cover, line in lines.items():
        places = (line.X - 0.5 * LENGTH) / line.spacing
        # As far as the largest support reaches beyond the kinks.
        near = (np.abs(places) <= 0.5 * width + max(lines) + 1.0) & line.real
        curves[cover] = places[near], approximation(line, edge(line, width))[near]
        if not marks:
            marks.append(theory(places[near], exact(line, width)[near]))
    return Panel(*marks, *by_cover(curves), grid=True, **options)
