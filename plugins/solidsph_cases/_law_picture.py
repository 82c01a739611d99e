"""Eq. 13: how the error of interpolation falls with the support, and with the spacing in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.polynomial import Polynomial

from solidsph_cases._error_law import (
    EQUAL,
    ON_LATTICE,
    TRAPEZOIDAL,
    discretisation_data,
    second_moment,
    slope,
    smoothing_data,
)

_MARKS = ("ko-", "ks--", "k^:")


def draw_law(kernel: str, f: Polynomial, path: Path) -> None:
    """Left the term in h^2 beside the second moment, right the term in dx/h by arrangement."""
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    h, errors = smoothing_data(kernel, f)
    m_2 = second_moment(kernel) * h**2
    for order, (name, factor, mark) in enumerate(
        zip(("f", "f'", "f''"), (0.5, 0.5, 1.0), ("ko", "ks", "k^"), strict=True)
    ):
        term = np.abs(factor * m_2 * f.deriv(order + 2)(0.0))
        left.loglog(h, term, color="0.75", linewidth=4.0, label="$h^2$ term" if not order else None)
        unit = 4 - order
        left.loglog(h, np.abs(errors[:, order]), mark, label=f"error of ${name}$ [m$^{unit}$]")
    left.set_xlabel("support radius h [m]")
    left.set_ylabel("error by smoothing at x = 0")
    left.legend(frameon=False, fontsize=9)

    labels = (ON_LATTICE, TRAPEZOIDAL, EQUAL)
    data = discretisation_data(kernel)
    for label, mark in zip(labels, _MARKS, strict=True):
        ratio, error = data[label]
        right.loglog(ratio, error, mark, label=f"{label}: order {slope(ratio, error):.2f}")
    ratio = np.array([0.08, 0.4])
    right.loglog(ratio, 0.3 * ratio**2, color="0.75", linewidth=4.0, label="paper: order 2")
    right.set_xlabel("spacing over support radius dx/h [1]")
    right.set_ylabel("error of $\\langle 1 \\rangle$ [1]")
    right.legend(frameon=False, fontsize=9)
    for axis in (left, right):
        axis.grid(color="0.93", which="both")
    figure.suptitle(f"The error law ({kernel}); Ismail & Reddy, eq. 13", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
