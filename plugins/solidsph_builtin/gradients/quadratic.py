"""The quadratically corrected gradient."""

from __future__ import annotations

import warnings
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs
from solidsph_builtin.gradients._equal_rows import by_distinct_rows
from solidsph_builtin.gradients._local_fits import LocalFits, portions
from solidsph_builtin.gradients.corrected import Corrected

# Largest sum of the lengths of a particle's weights, times its reach. A fit that relies on small
# differences of large weights amplifies noise by this factor, and the stable step shrinks with it.
# On lattices it is about 20 at a corner, five times that of a linear fit.
WORST_AMPLIFICATION = 60.0


@final
@attrs.frozen
class Quadratic(Gradient):
    """The slope of a local least squares fit with linear and quadratic terms, exact for both.

    At p the differences f_q - f_p are fitted by b(x_q - x_p) . a, where b holds the components of
    the offset and their products; the gradient is the linear part of a. The weight of a neighbour
    is -V_q W'(r) / r, with which a fit of linear terms alone is the `corrected` gradient. So the
    gradient is exact for a constant strain gradient, at free surfaces too, where the corrected one
    is one-sided and makes a bending beam too soft.

    Where the neighbours do not determine a quadratic fit (bodies fewer than about four particles
    thick), that particle falls back to the linear one, with a warning.
    """

    exact_degree: ClassVar[int] = 2

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return by_distinct_rows(pairs, kernel_gradients, volumes, _weights)


def _weights(pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
    weights = np.empty_like(kernel_gradients)
    poor = False
    for own, part in portions(pairs):
        fits = LocalFits.of_gradient(part, kernel_gradients[own], volumes, 2)
        weights[own], linear = quadratic_fit(fits, kernel_gradients[own], volumes)
        poor |= bool(linear.any())
    if poor:
        # Without a count: an engine may compute some rows at a time, and one warning is enough.
        warnings.warn(
            "gradient 'quadratic': some particles have too few or too flat neighbours for a "
            "quadratic fit and use the linear one; a larger cover or a finer spacing gives "
            "them more",
            stacklevel=2,
        )
    return pairs.of_differences(weights)


def quadratic_fit(fits: LocalFits, kernel_gradients: Array, volumes: Array) -> tuple[Array, Mask]:
    """Weights (m, d) of `fits`, and which of their rows (n,) have those of a linear fit instead.

    Raises:
        BuildError: the neighbours of a particle determine neither.
    """
    weights, noise = fits.of_degree(2).gradients()
    poor: Mask = noise > WORST_AMPLIFICATION
    if poor.any():
        replaced = fits.pairs.spread(poor)
        linear = Corrected().weights(fits.pairs, kernel_gradients, volumes)
        weights[replaced] = linear[replaced]
    return weights, poor
