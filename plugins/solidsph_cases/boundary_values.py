"""What becomes of a boundary value in the sums of SPH, by the ways to impose it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases import _boundary_theory as theory
from solidsph_cases import _boundary_ways as ways
from solidsph_cases._boundary_pictures import boundary_sheet
from solidsph_cases._boundary_ways import block_condition, block_size, largest_error, miss, smoothed
from solidsph_cases._compare import ROUNDING, closed_form
from solidsph_cases._line import LENGTH, F, Line, check_covers, complete_line, left_by_the_cut
from solidsph_cases._scene import check_count
from solidsph_cases.drawing.sheet import Sheet

_MOMENTS = "moments of the kernel on an endless lattice"
_DENSE = "sums written out and dense algebra"

# Values of 1e-2, by a solve whose residual is small whatever its condition.
_EXACT = 1e-12

_OMITTED = "would work even if the ghost particles are omitted"
_APPLIED = "such that the Dirichlet boundary conditions are applied exactly"
_CONVENTIONAL = "closer to the desired value [than without ghosts], but may not be exact"

# What the paper says of the value at the boundary, and of what is beside it, by way.
_PAPER_AT = {
    ways.NO_GHOSTS: "an error of up to 50 % at the boundary",
    ways.ENDS_SOLVED: _OMITTED,
    ways.CONSTANT: _CONVENTIONAL,
    ways.CONTINUED: "",
    ways.PRINTED: _APPLIED,
    ways.FULL: _APPLIED,
    ways.SMALLEST: _APPLIED,
}
_ESSENTIAL = "ghosts are essential to ensure the accuracy at near-boundary internal particles"
_SECONDARY = "set approximately: a secondary approximation of the gradients satisfies the condition"
_SINGULAR = "not positive-definite, and thus not having a unique inverse"


@final
@attrs.frozen
class BoundaryValues(Case):
    """(x - 1/2)^4 on (0, 1), whose smoothed value at both ends is to be its own; nothing moves.

    Without ghosts, with ghosts that carry the boundary's value or continue the function, by
    eq. 11 as printed, with what the interior contributes, and by the smallest change; then its
    smoothed slope. Each way through the handlers that scenes use. The largest cover is measured.
    """

    title = "Boundary values and slopes, by the ways to impose them"
    source = "Ismail & Reddy, section 2.3, Fig. 2, eqs. 11, 12"
    figures = ("fig-2",)
    sweep = {"cells": (20, 40, 80), "covers": ((2.5,), (3.5,), (5.5,))}

    kernel: str = "modified-mollifier"
    covers: Sequence[float] = (1.5, 2.5, 3.5, 4.5, 5.5)  # [spacings]
    cells: int = 40  # spacings from 0 to 1

    def __attrs_post_init__(self) -> None:
        check_covers("boundary-values", self.covers)
        check_count("boundary-values", "cells", self.cells, 4)
        if max(self.covers) > self.cells:
            raise SceneError(
                f"case 'boundary-values': cells must be at least the largest cover, so that the "
                f"ends do not see each other, got cells = {self.cells} and a cover of "
                f"{max(self.covers):g}"
            )

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """What the smallest change that is exact at the boundary does beside it."""
        start = "largest error of <f> beside the boundary, smallest change"
        found = next(m for m in measurements if m.quantity.startswith(start))
        return attrs.evolve(found, error=found.value)

    @property
    def resolution(self) -> float:
        return LENGTH / self.cells

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        line = self.lines()[max(self.covers)]
        return [
            *_values(line, f"cover {max(self.covers):g}"),
            *self._printed(),
            *_blocks(line),
            *_slopes(line),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Fig. 2 and what the ways make of the values and slopes."""
        return {"fig-2-boundary-values": boundary_sheet(self.lines(), self.kernel)}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        lines = self.lines()
        return {
            "fig-2-boundary-values": _table(lines[max(self.covers)]),
            "fig-2-by-cover": _table_by_cover(lines),
        }

    def lines(self) -> Mapping[float, Line]:
        """Both ends at particles, with ghosts for one support beyond either, by cover."""
        return {
            cover: complete_line(self.kernel, cover, self.cells, supports=1)
            for cover in sorted(self.covers)
        }

    def _printed(self) -> Iterator[Measurement]:
        """Eq. 11 as printed at the smaller covers."""
        for cover, line in list(self.lines().items())[:-1]:
            yield _row(
                f"<f> at the boundary, {ways.PRINTED}, cover {cover:g}",
                float(smoothed(line, ways.carried_values(line)[ways.PRINTED])[ways.ends(line)[0]]),
                theory.values_at_left_end(line)[ways.PRINTED],
                source=_MOMENTS,
                paper=_APPLIED,
                allowed=ROUNDING + left_by_the_cut(line)[1],
                power=4,
            )


def _values(line: Line, cover: str) -> Iterator[Measurement]:
    """<f> at the left end, and its largest error beside both, by way."""
    exact = theory.values_at_left_end(line)
    dense = theory.smoothed_values(line)
    found = {way: smoothed(line, v) for way, v in ways.carried_values(line).items()}
    left, asked = ways.ends(line)[0], float(F(0.0))
    for way, approximation in found.items():
        imposed = exact[way] == asked
        measured = _row(
            f"<f> at the boundary, {way}, {cover}",
            float(approximation[left]),
            exact[way],
            source="imposed" if imposed else _MOMENTS,
            paper=_PAPER_AT[way],
            allowed=_EXACT if imposed else ROUNDING + left_by_the_cut(line)[1],
            power=4,
        )
        if way == ways.CONSTANT and measured.passed:
            closer = abs(miss(line, approximation)) < abs(miss(line, found[ways.NO_GHOSTS]))
            verdict = f"{'closer' if closer else 'NOT closer'} than without ghosts, not exact"
            measured = attrs.evolve(measured, verdict=verdict)
        if way == ways.PRINTED and measured.passed:
            measured = attrs.evolve(measured, verdict="NOT exact: what the interior adds")
        yield measured
    alone = largest_error(line, found[ways.ENDS_SOLVED])
    for way, approximation in found.items():
        error = largest_error(line, approximation)
        measured = _row(
            f"largest error of <f> beside the boundary, {way}, {cover}",
            error,
            largest_error(line, dense[way]),
            source=_DENSE,
            paper=_OMITTED if way == ways.ENDS_SOLVED else _ESSENTIAL,
            # A solve loses the digits of its condition.
            allowed=_EXACT * block_condition(line),
            power=4,
        )
        if way in (ways.FULL, ways.SMALLEST) and measured.passed:
            verdict = f"{error / alone:.2g} times that of eq. 11 without ghosts"
            measured = attrs.evolve(measured, verdict=verdict)
        yield measured


def _blocks(line: Line) -> Iterator[Measurement]:
    """How well the blocks of boundary and ghosts can be inverted."""
    count = block_size(line)
    yield closed_form(
        f"condition of W's block of the boundary and {count - 1} ghosts",
        block_condition(line),
        theory.condition(line, count),
        source="eigenvalues of the same written out",
        paper="can be expensive, but can be computed once",
        allowed=_EXACT * block_condition(line),
    )
    for first in (0, 1):
        order = count - first
        block = line.gradient[first:count, first:count].toarray()
        sizes = np.linalg.svd(block, compute_uv=False)
        reference = theory.least_of_gradient(line, first, count)
        measured = closed_form(
            f"smallest over largest singular value of the gradient's block of order {order}",
            sizes[-1] / sizes[0],
            reference,
            source="antisymmetric: singular in odd orders" if order % 2 else "its eigenvalues",
            paper=_SINGULAR,
        )
        if order % 2 == 0 and reference > ROUNDING and measured.passed:
            measured = attrs.evolve(measured, verdict="has an inverse")
        yield measured


def _slopes(line: Line) -> Iterator[Measurement]:
    """<<f'>> at the left end, and its largest error beside both, mirrored and then set."""
    exact = theory.slopes_at_left_end(line)
    dense = theory.smoothed_slopes(line)
    for way, carried in ways.carried_slopes(line).items():
        approximation = smoothed(line, carried)
        imposed = way == ways.SLOPE_SET
        yield _row(
            f"<<f'>> at the boundary, {way}",
            float(approximation[ways.ends(line)[0]]),
            exact[way],
            source="imposed" if imposed else _MOMENTS,
            paper=_SECONDARY if imposed else "",
            allowed=_EXACT if imposed else ROUNDING + sum(left_by_the_cut(line)) / line.spacing,
            power=3,
        )
        yield _row(
            f"largest error of <<f'>> beside the boundary, {way}",
            largest_error(line, approximation, 1),
            largest_error(line, dense[way], 1),
            source=_DENSE,
            paper=_SECONDARY if imposed else "",
            allowed=ROUNDING + sum(left_by_the_cut(line)) / line.spacing,
            power=3,
        )


def _row(
    quantity: str,
    value: float,
    reference: float,
    *,
    source: str,
    paper: str,
    allowed: float,
    power: int,
) -> Measurement:
    measured = closed_form(quantity, value, reference, source=source, paper=paper, allowed=allowed)
    if source == _DENSE and measured.passed:
        measured = attrs.evolve(measured, verdict="as written out")
    return attrs.evolve(measured, unit=f"m^{power}")


def _table(line: Line) -> Curves:
    """What every particle carries and what becomes of it, ghosts on both sides first and last."""
    table = {
        "x [m]": line.X,
        "ghost [1]": (~line.real).astype(np.float64),
        "f exact [m^4]": F(line.X),
        "f' exact [m^3]": F.deriv()(line.X),
    }
    for name, power, carried in (
        ("f", 4, ways.carried_values(line)),
        ("f'", 3, ways.carried_slopes(line)),
    ):
        for way, values in carried.items():
            label = way.replace(",", "")  # a comma ends a column of the file
            table[f"{name} carried {label} [m^{power}]"] = values
            table[f"<{name}> {label} [m^{power}]"] = smoothed(line, values)
    return table


def _table_by_cover(lines: Mapping[float, Line]) -> Curves:
    """Misses at the left end, largest errors beside the ends, and the condition of the block."""
    columns: dict[str, list[float]] = {}
    for cover, line in lines.items():
        row = {"cover [1]": cover, "condition [1]": block_condition(line)}
        for way, values in ways.carried_values(line).items():
            approximation, label = smoothed(line, values), way.replace(",", "")
            row[f"miss at the boundary {label} [m^4]"] = miss(line, approximation)
            row[f"error beside {label} [m^4]"] = largest_error(line, approximation)
        for name, value in row.items():
            columns.setdefault(name, []).append(value)
    return {name: np.array(values) for name, values in columns.items()}
