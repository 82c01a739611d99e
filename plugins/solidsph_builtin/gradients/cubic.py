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
from solidsph_builtin.gradients.quadratic import WORST_AMPLIFICATION, quadratic_fit

# Of cubic coefficients in the outermost particles. Without them (infinite) a strain along a curved
# surface is off by the third derivative along it: the hoop stress of a ring of 8 particles across
# by 3.7 %, with 1 by 2.5 %, with 0.5 by 1.9 %, with 0.2 by 1.3 %. An inflated ring grows too little
# by 1.2 % with 0.2, by 0.9 % with 0.1. With 0.05 a single particle of a jittered lattice may be so
# stiff that the safe step is 3 % too large.
_PENALTY = 0.1

# How much more than a linear fit a cubic one may amplify noise. Inside a body it is 1.6 to 2.1
# times as much, in 1 to 3 dimensions, beside a surface 6 times and more.
_NOISIER = 3.0


@final
@attrs.frozen
class Cubic(Gradient):
    """The slope of a local least squares fit with terms up to the third degree, else the second.

    As `quadratic`, with cubic terms where they amplify noise no more than thrice as much as a
    linear fit: everywhere but in the outermost particles. There the cubic coefficients are held
    small: along a surface its particles determine them, across it they do not. On a lattice the
    gradient is of the fourth order. Sums that are to be exact to the second degree up to a surface
    need that inside (Strand 1994).
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
            quadratic, linear = quadratic_fit(fits, slopes, volumes)
            held, noise = fits.with_small_cubes(_PENALTY).gradients()
            few = part.spread(linear | ~(noise <= WORST_AMPLIFICATION))
            replaced = part.spread(poor)
            found[replaced] = np.where(few[:, None], quadratic, held)[replaced]
        weights[own] = found
    return pairs.of_differences(weights)
