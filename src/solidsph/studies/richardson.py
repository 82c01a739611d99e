"""Error bars without a reference, by least squares over three spacings or more."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import nan
from typing import final

import attrs
import numpy as np
from scipy.optimize import minimize_scalar

from solidsph.maths.arrays import Array

# Orders that the limit may be found with. A higher one that three results show is mostly scatter:
# no sum over particles converges faster up to a surface.
_ORDERS = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)

# Results that follow one of these much better have no limit, or not one that they let see: stress
# at a sharp corner or under a point load.
_WITHOUT_LIMIT = (-2.0, -1.0, -0.5, 0.2)
_MUCH = 0.5  # of the scatter

# The order that the results show is looked for between these.
_LOWEST, _HIGHEST = 0.2, 6.0

# Scatter about the power law, over the mean change from one spacing to the next, below which the
# law is seen; and what the distance to the limit is multiplied by if it is, and if it is not.
# Roache (1994) has 1.25 and 3. Where particles meet surfaces at other places on each refinement the
# scatter says more; half of it beside 2 is enough (tests/studies/test_error_bars.py).
_REGULAR, _SAFETY, _CAUTION = 0.3, 1.25, 2.0

# Without a limit in sight, the bar over all changes so far.
_UNKNOWN = 2.0


@final
@attrs.frozen
class Extrapolation:
    """Limit of a sequence of results, and how far it can be relied on."""

    order: float  # that the results show: value - limit ~ spacing^order; nan if there is none
    limit: float  # at spacing 0
    uncertainty: float  # of the limit, in its unit
    finest: float  # result at the finest spacing
    warning: str  # reason not to trust it; empty if there is none
    in_sight: bool = True  # whether the results tend to it; else it is the finest one

    @property
    def bar(self) -> float:
        """Error bar of the finest result, in its unit."""
        return abs(self.finest - self.limit) + self.uncertainty

    @property
    def index(self) -> float:
        """The bar relative to the finest result [-]; nan if that is 0."""
        return self.bar / abs(self.finest) if self.finest else nan

    @property
    def trusted(self) -> bool:
        """Whether the results follow a power of the spacing."""
        return not self.warning


def extrapolate(spacings: Sequence[float], values: Sequence[float]) -> Extrapolation:
    """Fit value = limit + c spacing^p, with weights of 1 / spacing.

    As Eca & Hoekstra (2014), J. Comput. Phys. 262, 104-130, with an order from 0.5 to 2, whichever
    leaves the least scatter. The bar of a result is its distance from the limit, and what the limit
    is uncertain by: a share of the finest one's distance, and half of the scatter.

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
    h = np.asarray(spacings, dtype=np.float64) / spacings[-1]
    f = np.asarray(values, dtype=np.float64)
    change = float(np.ptp(f)) / (len(f) - 1)
    if change == 0.0:
        return Extrapolation(nan, f[-1], 0.0, f[-1], "all are equal: nothing can be observed")
    limit, coefficient, scatter = min((_fit(h, f, p) for p in _ORDERS), key=lambda fit: fit[2])
    without = min(_fit(h, f, p)[2] for p in _WITHOUT_LIMIT)
    if without < min(_MUCH * scatter, _REGULAR * change):
        return Extrapolation(
            order=nan,
            limit=float(f[-1]),
            uncertainty=_UNKNOWN * float(np.ptp(f)),
            finest=float(f[-1]),
            warning="no limit is in sight: each refinement changes the value by no less than the "
            "one before, as at a sharp corner or under a point load",
            in_sight=False,
        )
    is_regular = scatter < _REGULAR * change
    beyond = (_SAFETY if is_regular else _CAUTION) - 1.0
    return Extrapolation(
        order=_observed_order(h, f),
        limit=limit,
        uncertainty=beyond * abs(coefficient) + 0.5 * scatter,
        finest=float(f[-1]),
        warning=""
        if is_regular
        else "not yet in the asymptotic range: from one spacing to the next the values change by "
        f"{change:.2g}, and scatter by {scatter:.2g} about every power of it",
    )


def _fit(h: Array, f: Array, order: float) -> tuple[float, float, float]:
    """Limit, coefficient and scatter of the power law of this order."""
    weights = (1.0 / h) / (1.0 / h).sum()
    law = np.stack([np.ones_like(h), h**order], axis=1)
    root = np.sqrt(weights)
    (limit, coefficient), *_ = np.linalg.lstsq(law * root[:, None], f * root, rcond=None)
    off = f - law @ np.array([limit, coefficient])
    scatter = np.sqrt((weights * off**2).sum() * len(h) / (len(h) - 2))
    return float(limit), float(coefficient), float(scatter)


def _observed_order(h: Array, f: Array) -> float:
    """The order of the least scatter; nan if it is at the end of what is looked at."""
    found = minimize_scalar(
        lambda p: _fit(h, f, p)[2], bounds=(_LOWEST, _HIGHEST), method="bounded"
    )
    order = float(found.x)
    return order if _LOWEST + 0.05 < order < _HIGHEST - 0.05 else nan
