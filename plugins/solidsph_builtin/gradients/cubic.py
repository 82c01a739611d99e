"""The cubically corrected gradient."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs
from solidsph_builtin.gradients._equal_rows import by_distinct_rows
from solidsph_builtin.gradients._local_fits import LocalFits, portions
from solidsph_builtin.gradients.quadratic import quadratic_fit

# How much more than a linear fit a cubic one may amplify noise. Inside a body it is 1.6 to 2.1
# times as much, in 1 to 3 dimensions, beside a surface 6 times and more.
_NOISIER = 3.0


@final
@attrs.frozen
class Cubic(Gradient):
    """The slope of a local least squares fit with terms up to the third degree, else the second.

    As `quadratic`, with cubic terms where they amplify noise no more than thrice as much as a
    linear fit: everywhere but in the outermost particles, which use the quadratic fit. On a lattice
    it is of the fourth order. Sums that are to be exact to the second degree up to a surface need
    that inside (Strand 1994).
    """

    exact_degree: ClassVar[int] = 2

    # On a lattice in space, with the cubic spline of 2.6 spacings, there are waves shorter than
    # three spacings whose gradient is zero, beside those that alternate; with 2.4 there are none.
    cover_in_space: ClassVar[float] = 0.925

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return by_distinct_rows(pairs, kernel_gradients, volumes, _weights)


def _weights(pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
    weights = np.empty_like(kernel_gradients)
    for own, part in portions(pairs):
        slopes = kernel_gradients[own]
        fits = LocalFits.of_gradient(part, slopes, volumes, 3)
        found, noise = fits.gradients()
        _, usual = fits.of_degree(1).gradients()
        poor = ~(noise <= _NOISIER * usual)
        if poor.any():
            replaced = part.spread(poor)
            quadratic, _ = quadratic_fit(fits, slopes, volumes)
            found[replaced] = quadratic[replaced]
        weights[own] = found
    return pairs.of_differences(weights)
