"""The error law of interpolation, eq. 13, from the moments of a kernel, and as it is measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.polynomial import Polynomial

from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct
from solidsph.studies.case import Measurement
from solidsph_cases._line import Line, complete_line, irregular_line
from solidsph_cases._moments import of_continuum

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
        error = abs(coefficient / reference - 1.0)
        yield Measurement(
            quantity=f"eq. 13: m_2 / h^2 by the error of {name}",
            value=coefficient,
            unit="1",
            reference=reference,
            source="second moment of the kernel by quadrature",
            error=error,
            passed=error <= _MOMENT_TOLERANCE,
            paper=_PAPER,
        )
        fitted = slope(h, errors[:, order])
        yield Measurement(
            quantity=f"eq. 13: order in h, {name}",
            value=fitted,
            unit="1",
            reference=2.0,
            source="Taylor's series",
            error=abs(fitted / 2.0 - 1.0),
            passed=abs(fitted - 2.0) <= _SMOOTHING_ORDER_TOLERANCE,
            paper=_PAPER,
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
        quantity=f"eq. 13: order in dx/h, {ON_LATTICE}",
        value=fitted,
        unit="1",
        source="Poisson's formula: no fixed order for a kernel that is smooth to all orders",
        verdict="faster than the paper's" if fitted > 2.0 else "not faster than the paper's",
        paper=_PAPER,
    )
    fitted = slope(*data[TRAPEZOIDAL])
    yield Measurement(
        quantity=f"eq. 13: order in dx/h, {TRAPEZOIDAL}",
        value=fitted,
        unit="1",
        reference=2.5,
        source="sums of independent errors: at least",
        error=abs(fitted / 2.5 - 1.0),
        passed=fitted >= 2.5 - _ORDER_TOLERANCE,
        paper=_PAPER,
    )
    fitted = slope(*data[EQUAL])
    yield Measurement(
        quantity=f"eq. 13: order in dx/h, {EQUAL}",
        value=fitted,
        unit="1",
        reference=1.5,
        source="sums of independent errors",
        error=abs(fitted / 1.5 - 1.0),
        passed=abs(fitted - 1.5) <= _ORDER_TOLERANCE,
        paper=_PAPER,
    )


def discretisation_data(kernel: str) -> Mapping[str, tuple[Array, Array]]:
    """dx/h (k,) and the error of <1> (k,), by arrangement of the particles."""
    lattice = [[complete_line(kernel, c, round(c / _SUPPORT))] for c in _COVERS]
    trapezoidal, equal = (
        [
            [
                irregular_line(kernel, c, round(c / _SUPPORT), seed=seed, own_cells=own_cells)
                for seed in range(_SEEDS)
            ]
            for c in _IRREGULAR_COVERS
        ]
        for own_cells in (True, False)
    )
    return {
        ON_LATTICE: _errors_of_mass(lattice),
        TRAPEZOIDAL: _errors_of_mass(trapezoidal),
        EQUAL: _errors_of_mass(equal),
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
