"""What the sums of SPH make of a known function and its derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, final

import attrs
import numpy as np
from numpy.polynomial import Polynomial

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases import _error_law as law
from solidsph_cases._compare import ROUNDING, closed_form
from solidsph_cases._line import (
    LENGTH,
    F,
    Line,
    bare_line,
    check_covers,
    complete_line,
    left_by_the_cut,
    whole_line,
)
from solidsph_cases._moments import Moments, of_lattice
from solidsph_cases._scene import check_count
from solidsph_cases._slopes import SlopeOfQuartic
from solidsph_cases.drawing.profiles import KEY, by_cover
from solidsph_cases.drawing.sheet import Panel, Sheet, note, theory

ORDERS = {0: "f", 1: "f'", 2: "f''"}

# At which the discrete gradient of f = x is known to three digits, with the modified mollifier
# normalised by the particles' own sum.
_COVERS_OF_SLOPES = (1.5, 2.0, 2.5, 3.5)

_LATTICE = "moments of the kernel on an endless lattice"


@final
@attrs.frozen
class Interpolation(Case):
    """(x - 1/2)^4 on (0, 1) and its derivatives, from values at particles; nothing moves.

    Fig. 3 without extra particles, Figs. 4 and 5 with ghosts, finely and coarsely. The second
    derivative is the gradient of the gradient. For a polynomial every sum has a closed form, by
    the moments of the kernel; the error law, eq. 13, follows from them and is measured.
    """

    title = "Interpolation of a quartic and its derivatives"
    source = "Ismail & Reddy, section 3, Figs. 3 to 5, eq. 13"
    figures = ("fig-3", "fig-4", "fig-5", "eq-13")

    kernel: str = "modified-mollifier"
    covers: Sequence[float] = (1.5, 2.5, 3.5, 4.5, 5.5)  # [spacings]
    fine: int = 100  # spacings from 0 to 1, Figs. 3 and 4
    coarse: int = 10  # spacings from 0 to 1, Fig. 5

    def __attrs_post_init__(self) -> None:
        check_covers("interpolation", self.covers)
        check_count("interpolation", "fine", self.fine, 4)
        check_count("interpolation", "coarse", self.coarse, 4)
        if max(self.covers) > self.fine:
            raise SceneError(
                f"case 'interpolation': fine must be at least the largest cover, so that a support "
                f"leaves one end only, got fine = {self.fine} and a cover of {max(self.covers):g}"
            )

    def priced(self) -> Case:
        """One slope by one cover."""
        return SlopeOfQuartic(kernel=self.kernel)

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [
            *self._ends(),
            *self._errors(
                self.fine,
                "Fig. 4",
                small="1.5 spacings do not approximate the gradients well",
                other="most cover sizes interpolate f, f' and f'' well",
            ),
            *self._errors(
                self.coarse,
                "Fig. 5",
                small="substantial errors whatever the cover",
                other="substantial errors whatever the cover",
            ),
            *self._slopes_of_x(),
            *law.smoothing_errors(self.kernel, F),
            *law.discretisation_errors(self.kernel),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Figs. 3 to 5, and the error law."""
        bare = self.bare()
        reach = 2.5 * max(line.kernel.support_radius for line in bare.values())
        # The gradients leave the picture at the ends, where f itself counts as a step.
        limits: Sequence[tuple[float | None, float | None]] = (
            *((None, None), (-1.5, 1.5), (-12.0, 12.0)),
        )
        whole = [_panel(bare, order, ylim=limits[order]) for order in ORDERS]
        near = [
            _panel(bare, order, "" if order else "the left end", reach=reach, x="x [m]")
            for order in ORDERS
        ]
        fine, coarse = (
            [
                _panel(
                    self.complete(cells),
                    order,
                    "" if order else f"spacing {LENGTH / cells:g} m",
                    x="x [m]",
                    same_x=f"{order}",
                )
                for order in ORDERS
            ]
            for cells in (self.fine, self.coarse)
        )
        spacing = f"spacing {LENGTH / self.fine:g} m ({self.kernel}); Ismail & Reddy, Fig. 3"
        ends = f"$(x - 1/2)^4$ without extra particles, {spacing}"
        ghosts = f"with ghosts beyond the ends ({self.kernel}); Ismail & Reddy, Figs. 4 and 5"
        figure_3 = Sheet([whole, near], (13.0, 8.0), ends, key=near[0], key_style=KEY)
        figures_4_5 = Sheet(
            [fine, coarse], (13.0, 8.0), f"$(x - 1/2)^4$ {ghosts}", key=coarse[0], key_style=KEY
        )
        return {
            "fig-3-no-extra-particles": figure_3,
            "fig-4-5-fine-and-coarse": figures_4_5,
            "eq-13-error-law": law.pictures(self.kernel, F),
        }

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        return {
            "fig-3-no-extra-particles": _table(self.bare()),
            "fig-4-fine": _table(self.complete(self.fine)),
            "fig-5-coarse": _table(self.complete(self.coarse)),
            **law.tables(self.kernel, F),
        }

    def bare(self) -> Mapping[float, Line]:
        """Particles on (0, 1) only, by cover."""
        return {cover: bare_line(self.kernel, cover, self.fine) for cover in self.covers}

    def complete(self, cells: int) -> Mapping[float, Line]:
        """Ghosts on either side, by cover."""
        return {cover: complete_line(self.kernel, cover, cells) for cover in self.covers}

    def _ends(self) -> Iterator[Measurement]:
        """How far the approximation droops where half of the support is empty."""
        cover = max(self.covers)
        droops = 'an error of up to 50 % at the boundary, "drooping"'
        line = bare_line(self.kernel, cover, self.fine)
        moments = of_lattice(line.kernel, line.spacing)
        f, one = F(line.X), np.ones(len(line.X))
        at = f"at the end without ghosts, cover {cover:g}"
        yield closed_form(
            f"Fig. 3: <1> {at}",
            (line.smoothing @ one)[0],
            0.5 * moments.value[0],
            source="half of the sum over a lattice; 1/2 for many particles",
            paper=droops,
        )
        yield closed_form(
            f"Fig. 3: <f> / f {at}",
            (line.smoothing @ f)[0] / f[0],
            moments.smoothed_at_left_end(F)(0.0) / F(0.0),
            source="one-sided " + _LATTICE,
            paper=droops,
        )
        yield closed_form(
            f"Fig. 3: <f'> / f' {at}",
            (line.gradient @ f)[0] / F.deriv()(0.0),
            moments.differentiated_at_left_end(F)(0.0) / F.deriv()(0.0),
            source="one-sided " + _LATTICE,
            paper="a large effect on the subsequent approximations of derivatives",
        )
        whole = whole_line(self.kernel, cover, self.fine)
        half_more = 0.5 * whole.spacing * float(whole.kernel.value(np.zeros(1))[0])
        yield closed_form(
            f"Fig. 3: <1> {at}, a whole cell for the last particle",
            (whole.smoothing @ one)[0],
            0.5 * moments.value[0] + half_more,
            source="(1 + spacing W(0)) / 2",
            paper=droops,
        )

    def _errors(self, cells: int, figure: str, small: str, other: str) -> Iterator[Measurement]:
        """Largest errors of f and its derivatives on (0, 1), each over the largest value there.

        `small` and `other` are what the paper says of 1.5 spacings, and of larger covers.
        """
        lines = self.complete(cells)
        moments = {c: of_lattice(line.kernel, line.spacing) for c, line in lines.items()}
        ends = dict.fromkeys((min(self.covers), max(self.covers)))
        for order, name in ORDERS.items():
            found = {c: largest_error(line, order) for c, line in lines.items()}
            theory = {
                c: largest_error(line, order, in_theory(moments[c], order))
                for c, line in lines.items()
            }
            for cover in ends:
                yield closed_form(
                    f"{figure}: largest error of {name}, cover {cover:g}",
                    found[cover],
                    theory[cover],
                    source=_LATTICE,
                    paper=small if cover < 2.0 else other,
                )
            best = min(found, key=found.__getitem__)
            yield closed_form(
                f"{figure}: largest error of {name}, at its smallest: cover {best:g}",
                found[best],
                min(theory.values()),
                source=_LATTICE,
                paper=other,
            )

    def _slopes_of_x(self) -> Iterator[Measurement]:
        """The gradient of f = x, plain, by the particles' own sum, and corrected."""
        for cover in _COVERS_OF_SLOPES:
            plain = complete_line(self.kernel, cover, self.coarse)
            corrected = complete_line(self.kernel, cover, self.coarse, gradient="corrected")
            moments = of_lattice(plain.kernel, plain.spacing)
            middle = len(plain.X) // 2
            # About the particle, where the value itself is zero: a cut kernel could add some of it.
            x = plain.X - plain.X[middle]
            slope = (plain.gradient @ x)[middle]
            mass = (plain.smoothing @ np.ones(len(plain.X)))[middle]
            cut_slope, cut_mass = left_by_the_cut(plain)
            cut_slope /= abs(moments.slope[1])
            says = "1.5 spacings under-predict the gradient" if cover < 2.0 else ""
            for label, value, reference, allowed in (
                ("plain", slope, moments.slope[1], cut_slope),
                (
                    "over <1>",
                    slope / mass,
                    moments.slope[1] / moments.value[0],
                    cut_slope + cut_mass,
                ),
                ("corrected", (corrected.gradient @ x)[middle], 1.0, 0.0),
            ):
                yield closed_form(
                    f"gradient of f = x, {label}, cover {cover:g}",
                    value,
                    reference,
                    source="exact for linear fields" if label == "corrected" else _LATTICE,
                    paper="" if label == "corrected" else says,
                    allowed=ROUNDING + allowed,
                )


def approximated(line: Line, order: int) -> Array:
    """<f>, <f'> or <<f'>'> at every particle (n,)."""
    f = F(line.X)
    matrices = (line.smoothing,), (line.gradient,), (line.gradient, line.gradient)
    for matrix in matrices[order]:
        f = matrix @ f
    return f


def largest_error(line: Line, order: int, approximation: Polynomial | None = None) -> float:
    """Of what the particles make of a derivative on (0, 1), or of `approximation`, over its
    largest value there."""
    X = line.X[line.real]
    true = F.deriv(order)(X)
    made = approximated(line, order)[line.real] if approximation is None else approximation(X)
    return float(np.abs(made - true).max() / np.abs(true).max())


def in_theory(moments: Moments, order: int) -> Polynomial:
    """The same as a polynomial, where supports are complete."""
    first = moments.differentiated(F)
    return (moments.smoothed(F), first, moments.differentiated(first))[order]


def _table(lines: Mapping[float, Line]) -> Curves:
    """Every derivative at every particle of (0, 1), for every cover; all have the same places."""
    first = next(iter(lines.values()))
    X = first.X[first.real]
    table = {"x [m]": X}
    for order, name in ORDERS.items():
        unit = f"[m^{4 - order}]"
        table[f"{name} exact {unit}"] = F.deriv(order)(X)
        for cover, line in lines.items():
            table[f"{name} cover {cover:g} {unit}"] = approximated(line, order)[line.real]
    return table


def _panel(
    lines: Mapping[float, Line], order: int, words: str = "", reach: float = LENGTH, **options: Any
) -> Panel:
    """f or a derivative from 0 to `reach` [m], exact and by every cover."""
    x = np.linspace(0.0, min(reach, LENGTH), 400)
    curves = {}
    for cover, line in lines.items():
        shown = line.real & (reach >= line.X)
        curves[cover] = line.X[shown], approximated(line, order)[shown]
    return Panel(
        theory(x, F.deriv(order)(x)),
        *by_cover(curves),
        note(words),
        y=f"$\\langle {ORDERS[order]} \\rangle$ [m$^{4 - order}$]",
        grid=True,
        **options,
    )
