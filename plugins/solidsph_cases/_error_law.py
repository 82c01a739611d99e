"""The error law of interpolation, eq. 13, from the moments of a kernel, and as it is measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.polynomial import Polynomial

from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct
from solidsph.studies.case import Curves, Measurement
from solidsph_cases._line import Line, complete_line, irregular_line
from solidsph_cases._moments import of_continuum
from solidsph_cases.drawing.sheet import Panel, Sheet, line, mark, theory

ON_LATTICE = "on a lattice"
TRAPEZOIDAL = "irregular, trapezoidal weights"
EQUAL = "irregular, equal weights"

_PAPER = "error ~ h^2, (dx/h)^2"

# Smoothing: supports from 0.2 down to 0.05 of the range, where the next term, in h^4, is small.
_COVER = 12.5
_CELLS = (62, 88, 125, 177, 250)

# Discretisation: a support of this part of the range, with more and more particles within.
_SUPPORT = 0.1
_COVERS = (2.5, 3.5, 4.5, 5.5)
_IRREGULAR_COVERS = (3.5, 5.5, 8.5, 13.5)
_SEEDS = 3

# The second moment is the lattice's, not the integral's: they differ by the second term.
_MOMENT_TOLERANCE = 0.01
# The term in h^4 of f, some hundredth of that in h^2 at the largest support.
_SMOOTHING_ORDER_TOLERANCE = 0.02
# Orders of random errors, over some thirty independent supports at each of four covers.
_ORDER_TOLERANCE = 0.35


def smoothing_errors(kernel: str, f: Polynomial) -> Iterator[Measurement]:
    """The term in h^2: its order, and its coefficient against the second moment of the kernel.

    With complete supports <f> - f = m_2 / 2 f'' + ..., <f'> - f' = m_2 / 2 f''' + ..., and the
    gradient of the gradient smooths twice: m_2 f''''. What the particles leave of it, which the
    values of <1> and <x'> tell, is the other term and taken off.
    """
    h, errors = smoothing_data(kernel, f)
    reference = second_moment(kernel)
    for name, order, factor in (("f", 0, 0.5), ("f'", 1, 0.5), ("f''", 2, 1.0)):
        # Of a quartic, a h^2 + b h^4 is all there is.
        (a, _), *_ = np.linalg.lstsq(np.column_stack([h**2, h**4]), errors[:, order])
        coefficient = float(a) / (factor * float(f.deriv(order + 2)(0.0)))
        source = "second moment of the kernel by quadrature"
        passed = abs(coefficient / reference - 1.0) <= _MOMENT_TOLERANCE
        yield _row(f"m_2 / h^2 by the error of {name}", coefficient, reference, source, passed)
        fitted = slope(h, errors[:, order])
        passed = abs(fitted - 2.0) <= _SMOOTHING_ORDER_TOLERANCE
        yield _row(f"order in h, {name}", fitted, 2.0, "Taylor's series", passed)


def _row(quantity: str, value: float, reference: float, source: str, passed: bool) -> Measurement:
    error = abs(value / reference - 1.0)
    return Measurement(
        f"eq. 13: {quantity}", value, "1", reference, source, error, passed=passed, paper=_PAPER
    )


def smoothing_data(kernel: str, f: Polynomial) -> tuple[Array, Array]:
    """Supports h (k,) [m], and the errors by smoothing of f and two derivatives at x = 0 (k, 3)."""
    lines = [complete_line(kernel, _COVER, cells) for cells in _CELLS]
    h = np.array([line.kernel.support_radius for line in lines])
    return h, np.array([_smoothing_errors_at_left_end(line, f) for line in lines])


def second_moment(kernel: str) -> float:
    """m_2 / h^2 of a kernel by quadrature [-]."""
    smoothing = smoothing_kernel(construct("kernels", kernel), 1, 1.0)
    return of_continuum(smoothing).value[2]


def discretisation_errors(kernel: str) -> Iterator[Measurement]:
    """The term in dx/h: its order by <1>, on a lattice and on irregular particles.

    On a lattice the sum differs from the integral by the kernel's Fourier transform at multiples
    of 2 pi / dx (Poisson): as smooth as the kernel is, so fast it falls. Where particles stand
    irregularly their displacements d give sums of independent errors V d dW/dx if all weigh the
    same, which is (dx/h)^(3/2), and with trapezoidal weights terms in d^2, (dx/h)^(5/2) or less.
    """
    data = discretisation_data(kernel)
    fitted = slope(*data[ON_LATTICE])
    yield Measurement(
        f"eq. 13: order in dx/h, {ON_LATTICE}",
        fitted,
        "1",
        source="Poisson's formula: no fixed order for a kernel that is smooth to all orders",
        verdict="faster than the paper's" if fitted > 2.0 else "not faster than the paper's",
        paper=_PAPER,
    )
    fitted, source = slope(*data[TRAPEZOIDAL]), "sums of independent errors: at least"
    passed = fitted >= 2.5 - _ORDER_TOLERANCE
    yield _row(f"order in dx/h, {TRAPEZOIDAL}", fitted, 2.5, source, passed)
    fitted, source = slope(*data[EQUAL]), "sums of independent errors"
    passed = abs(fitted - 1.5) <= _ORDER_TOLERANCE
    yield _row(f"order in dx/h, {EQUAL}", fitted, 1.5, source, passed)


def discretisation_data(kernel: str) -> Mapping[str, tuple[Array, Array]]:
    """dx/h (k,) and the error of <1> (k,), by arrangement of the particles."""

    def irregular(cover: float, own_cells: bool) -> Sequence[Line]:
        cells = round(cover / _SUPPORT)
        return [
            irregular_line(kernel, cover, cells, seed=seed, own_cells=own_cells)
            for seed in range(_SEEDS)
        ]

    lattice = [[complete_line(kernel, c, round(c / _SUPPORT))] for c in _COVERS]
    return {
        ON_LATTICE: _errors_of_mass(lattice),
        TRAPEZOIDAL: _errors_of_mass([irregular(c, True) for c in _IRREGULAR_COVERS]),
        EQUAL: _errors_of_mass([irregular(c, False) for c in _IRREGULAR_COVERS]),
    }


def _smoothing_errors_at_left_end(line: Line, f: Polynomial) -> Array:
    """Errors of <f>, <f'>, <<f'>'> at x = 0, where they are largest, less those of <1>, <x'>."""
    first = int(np.argmax(line.real))
    x, values = line.X, f(line.X)
    mass = (line.smoothing @ np.ones(len(x)))[first]
    unit = (line.gradient @ x)[first]
    made = (
        (line.smoothing @ values)[first] - mass * f(0.0),
        (line.gradient @ values)[first] - unit * f.deriv()(0.0),
        (line.gradient @ (line.gradient @ values))[first] - unit**2 * f.deriv(2)(0.0),
    )
    return np.array(made, dtype=np.float64)


def _errors_of_mass(levels: Sequence[Sequence[Line]]) -> tuple[Array, Array]:
    """dx/h (k,), and of <1> the root of the mean square error over inner particles and lines."""
    errors = []
    for lines in levels:
        H = lines[0].kernel.support_radius
        mass = of_continuum(lines[0].kernel).value[0]
        inner = [
            (line.smoothing @ np.ones(len(line.X)))[(line.X > H) & (line.X < 1.0 - H)] - mass
            for line in lines
        ]
        errors.append(np.sqrt(np.mean(np.concatenate(inner) ** 2)))
    spacings = np.array([lines[0].spacing / lines[0].kernel.support_radius for lines in levels])
    return spacings, np.array(errors)


def slope(x: Array, y: Array) -> float:
    """Slope of log |y| over log x, by least squares."""
    return float(np.polyfit(np.log(x), np.log(np.abs(y)), 1)[0])


def pictures(kernel: str, f: Polynomial) -> Sheet:
    """The term in h^2 beside the second moment, and the term in dx/h by arrangement."""
    h, errors = smoothing_data(kernel, f)
    m_2 = second_moment(kernel) * h**2
    smoothing = []
    for order, (name, factor, style) in enumerate(
        zip(("f", "f'", "f''"), (0.5, 0.5, 1.0), ("ko", "ks", "k^"), strict=True)
    ):
        term = np.abs(factor * m_2 * f.deriv(order + 2)(0.0))
        label = f"error of ${name}$ [m$^{4 - order}$]"
        smoothing.append(theory(h, term, None if order else "$h^2$ term"))
        smoothing.append(line(h, np.abs(errors[:, order]), style, label=label))
    ratio = np.array([0.08, 0.4])
    discretisation = [theory(ratio, 0.3 * ratio**2, "paper: order 2")]
    for (name, (ratio, error)), style in zip(
        discretisation_data(kernel).items(), ("ko-", "ks--", "k^:"), strict=True
    ):
        label = f"{name}: order {slope(ratio, error):.2f}"
        discretisation.append(line(ratio, error, style, label=label))
    log = (mark("loglog"), mark("grid", color="0.93", which="both"))
    left = Panel(
        *(*log, *smoothing),
        x="support radius h [m]",
        y="error by smoothing at x = 0",
        legend={},
    )
    right = Panel(
        *(*log, *discretisation),
        x="spacing over support radius dx/h [1]",
        y="error of $\\langle 1 \\rangle$ [1]",
        legend={},
    )
    return Sheet([[left, right]], (12.0, 5.0), f"The error law ({kernel}); Ismail & Reddy, eq. 13")


def tables(kernel: str, f: Polynomial) -> Mapping[str, Curves]:
    """The same as tables."""
    h, errors = smoothing_data(kernel, f)
    smoothing = {"h [m]": h}
    for order, name in enumerate(("f", "f'", "f''")):
        smoothing[f"error of {name} [m^{4 - order}]"] = errors[:, order]
    discretisation = {}
    for name, (ratio, error) in discretisation_data(kernel).items():
        label = name.replace(",", "")  # a comma ends a column of the file
        discretisation[f"dx/h {label} [1]"] = ratio
        discretisation[f"error of <1> {label} [1]"] = error
    return {"eq-13-smoothing": smoothing, "eq-13-discretisation": discretisation}
