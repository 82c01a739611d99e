"""The quadratically corrected gradient."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs
from solidsph_builtin.gradients.corrected import Corrected

# Beyond this condition number of the scaled moment matrix the neighbours do not determine second
# derivatives; of good arrangements, surfaces included, it is below some thousands.
_WORST_CONDITION = 1e7

# Largest sum of the lengths of a particle's weights, times its reach. A fit that relies on small
# differences of large weights amplifies noise by this factor, and the stable step shrinks with it.
# On lattices it is about 20 at a corner, five times that of a linear fit.
_WORST_AMPLIFICATION = 60.0

# Pairs treated at once: a moment matrix in 3D has 81 entries a pair.
_PAIRS_AT_ONCE = 100_000


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
        for rows in _portions(pairs):
            own = slice(pairs.starts[rows.start], pairs.starts[rows.stop])
            weights[own], poor[rows] = _fitted(pairs, rows, kernel_gradients[own], volumes)
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


def _portions(pairs: Pairs) -> Iterator[slice]:
    """Runs of rows with about as many pairs as are treated at once."""
    first = 0
    while first < pairs.row_count:
        last = int(np.searchsorted(pairs.starts, pairs.starts[first] + _PAIRS_AT_ONCE, "right"))
        stop = max(first + 1, last - 1)
        yield slice(first, min(stop, pairs.row_count))
        first = stop


def _fitted(
    pairs: Pairs, rows: slice, kernel_gradients: Array, volumes: Array
) -> tuple[Array, Mask]:
    """Weights of the pairs of some rows, (k, d), and which of these rows have a poor fit."""
    own = slice(pairs.starts[rows.start], pairs.starts[rows.stop])
    starts = pairs.starts[rows.start : rows.stop] - pairs.starts[rows.start]
    row = np.repeat(np.arange(len(starts)), np.diff(pairs.starts[rows.start : rows.stop + 1]))
    offsets, distances = pairs.offsets[own], pairs.distances[own]
    d = offsets.shape[1]
    # Offsets in units of the support, so that the entries of the moments are of one size.
    reach = np.maximum.reduceat(distances, starts)[row, None]
    scaled = offsets / np.where(reach > 0.0, reach, 1.0)
    upper = np.triu_indices(d)
    basis = np.hstack([scaled, scaled[:, upper[0]] * scaled[:, upper[1]]])
    w = closeness(kernel_gradients, distances) * volumes[pairs.columns[own]]
    moments = np.add.reduceat(
        (w[:, None, None] * basis[:, :, None]) * basis[:, None, :], starts, axis=0
    )
    poor = ~(np.linalg.cond(moments) < _WORST_CONDITION)
    moments[poor] = np.eye(basis.shape[1])  # any regular matrix: these rows are replaced
    inverse = np.linalg.inv(moments)
    # One step of refinement: the error of the inverse would show as stress in a rigid rotation.
    missing = np.eye(basis.shape[1])[:d] - inverse[:, :d] @ moments
    slopes = inverse[:, :d] + missing @ inverse
    weights = np.einsum("mij,mj->mi", slopes[row], w[:, None] * basis)
    poor |= np.add.reduceat(np.linalg.norm(weights, axis=1), starts) > _WORST_AMPLIFICATION
    return weights / np.where(reach > 0.0, reach, 1.0), poor


def closeness(kernel_gradients: Array, distances: Array) -> Array:
    """-W'(r) / r of every pair, (k,); 0 for self pairs, whose offset is zero."""
    safe = np.where(distances > 0.0, distances, 1.0)
    return np.where(distances > 0.0, np.linalg.norm(kernel_gradients, axis=1) / safe, 0.0)
