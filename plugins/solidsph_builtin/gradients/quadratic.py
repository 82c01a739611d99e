"""The quadratically corrected gradient."""

from __future__ import annotations

import warnings
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs
from solidsph_builtin.gradients._local_fits import LocalFits, closeness, portions
from solidsph_builtin.gradients.corrected import Corrected

# Beyond this condition number of the scaled moment matrix the neighbours do not determine second
# derivatives; of good arrangements, surfaces included, it is below some thousands.
_WORST_CONDITION = 1e7

# Largest sum of the lengths of a particle's weights, times its reach. A fit that relies on small
# differences of large weights amplifies noise by this factor, and the stable step shrinks with it.
# On lattices it is about 20 at a corner, five times that of a linear fit.
_WORST_AMPLIFICATION = 60.0


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
        weights = np.empty_like(kernel_gradients)
        poor = np.zeros(pairs.row_count, dtype=np.bool_)
        for rows, own, part in portions(pairs):
            w = closeness(kernel_gradients[own], part.distances) * volumes[part.columns]
            weights[own], poor[rows] = _fitted(LocalFits.of(part, w, self.exact_degree))
        if poor.any():
            # Without a count: an engine may compute some rows at a time, and one warning is enough.
            warnings.warn(
                "gradient 'quadratic': some particles have too few or too flat neighbours for a "
                "quadratic fit and use the linear one; a larger cover or a finer spacing gives "
                "them more",
                stacklevel=2,
            )
            replaced = pairs.spread(poor)
            linear = Corrected().weights(pairs, kernel_gradients, volumes)
            weights[replaced] = linear[replaced]
        return pairs.of_differences(weights)


def _fitted(fits: LocalFits) -> tuple[Array, Mask]:
    """Weights of the pairs, (m, d), and which of the rows have a poor fit, (n,)."""
    moments, d = fits.moments, fits.pairs.offsets.shape[1]
    sizes, directions = np.linalg.eigh(moments)
    poor = ~(sizes[:, 0] * _WORST_CONDITION > sizes[:, -1])
    sizes[poor] = 1.0  # any: these rows are replaced
    inverse = (directions / sizes[:, None, :]) @ directions.transpose(0, 2, 1)
    # One step of refinement: the error of the inverse would show as stress in a rigid rotation.
    missing = np.eye(moments.shape[1])[:d] - inverse[:, :d] @ moments
    slopes = inverse[:, :d] + missing @ inverse
    padded = fits.weights * (fits.basis @ slopes.transpose(0, 2, 1))
    poor |= np.sqrt(np.einsum("nmi,nmi->nm", padded, padded)).sum(axis=1) > _WORST_AMPLIFICATION
    return fits.of_pairs(padded / fits.units[:, None, None]), poor
