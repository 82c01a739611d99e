"""Error bars without a reference, by Richardson extrapolation over three spacings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import isfinite, log, nan

import attrs
from scipy.optimize import brentq

_SAFETY = 1.25  # of the grid convergence index over three spacings (Roache 1994)

# Range of observed orders in which a power of the spacing describes the results.
_LOWEST, _HIGHEST = 0.5, 6.0


@attrs.frozen
class Extrapolation:
    """Limit of a sequence of results, and the error bar of the finest."""

    order: float  # observed p of value - limit ~ spacing^p; nan if there is none
    limit: float  # at spacing 0
    index: float  # grid convergence index: relative error bar of the finest value [-]
    warning: str  # reason not to trust it; empty if there is none

    @property
    def trusted(self) -> bool:
        """Whether the sequence appears to be in the asymptotic range."""
        return not self.warning


def extrapolate(spacings: Sequence[float], values: Sequence[float]) -> Extrapolation:
    """Extrapolate the three finest results: Celik et al. (2008), J. Fluids Eng. 130, 078001.

    With four or more results, the order of the preceding three must agree.

    Args:
        spacings: (k,) from coarse to fine [m], k >= 3.
        values: (k,) of one quantity.

    Raises:
        ValueError: there are fewer than three, or spacings do not fall.
    """
    if len(spacings) != len(values) or len(spacings) < 3:
        raise ValueError(f"at least three results are needed, got {len(values)}")
    if any(fine >= coarse for coarse, fine in pairwise(spacings)):
        raise ValueError(f"spacings must fall from coarse to fine, got {list(spacings)}")
    result = _of_three(spacings[-3:], values[-3:])
    if result.trusted and len(spacings) > 3:
        before = _of_three(spacings[-4:-1], values[-4:-1])
        if not before.trusted or abs(before.order - result.order) > 0.5 * result.order:
            return attrs.evolve(
                result,
                warning="not yet in the asymptotic range: the observed order changes from "
                f"{before.order:.2g} to {result.order:.2g}; refine further",
            )
    return result


def _of_three(spacings: Sequence[float], values: Sequence[float]) -> Extrapolation:
    (h3, h2, h1), (f3, f2, f1) = spacings, values
    coarse, fine = f3 - f2, f2 - f1
    if fine == 0.0:
        if coarse == 0.0:
            return Extrapolation(nan, f1, 0.0, "all three are equal: nothing can be observed")
        return Extrapolation(
            nan, f1, nan, "the last refinement changed nothing: no order can be observed"
        )
    largest = _SAFETY * max(abs(coarse), abs(fine)) / abs(f1) if f1 else nan
    if coarse * fine < 0.0:
        return Extrapolation(
            nan,
            f1,
            largest,
            "the results oscillate: refinement crosses the limit, so that errors may be small by "
            "chance; the bar is the largest change",
        )
    order = _order(h2 / h1, h3 / h2, coarse / fine)
    if not _LOWEST <= order <= _HIGHEST:
        observed = f"{order:.2g}" if isfinite(order) else "none"
        return Extrapolation(
            order,
            f1,
            largest,
            f"not in the asymptotic range: the observed order is {observed}; refine further; the "
            "bar is the largest change",
        )
    change = fine / ((h2 / h1) ** order - 1.0)
    limit = f1 - change
    return Extrapolation(order, limit, _SAFETY * abs(change) / abs(f1) if f1 else nan, "")


def _order(fine_ratio: float, coarse_ratio: float, changes: float) -> float:
    """p of r21^p (r32^p - 1) / (r21^p - 1) = (f3 - f2) / (f2 - f1); nan if there is none."""

    def residual(p: float) -> float:
        return (
            p * log(fine_ratio)
            + log((coarse_ratio**p - 1.0) / (fine_ratio**p - 1.0))
            - log(changes)
        )

    low, high = 1e-3, 20.0
    if residual(low) * residual(high) > 0.0:
        return nan
    return float(brentq(residual, low, high))
