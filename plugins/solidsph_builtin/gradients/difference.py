"""The plain gradient applied to differences."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.arrays import Array
from solidsph.interfaces.gradient import Gradient
from solidsph.neighbours import Pairs


@final
@attrs.frozen
class Difference(Gradient):
    """grad f_p = sum over q of (f_q - f_p) dW/dx_p V_q: the gradient of a constant is zero.

    Equal to the standard one where supports are complete, and unlike it independent of where the
    body stands, which the updated Lagrangian form needs: there, moved neighbours unbalance the
    weights.
    """

    exact_degree: ClassVar[int] = 0

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return differences(pairs, kernel_gradients * volumes[pairs.columns, None])


def differences(pairs: Pairs, weights: Array) -> Array:
    """The same weights (m, d) acting on f_q - f_p: each row is made to add up to zero."""
    weights = weights.copy()
    weights[pairs.self_pairs] = 0.0
    weights[pairs.self_pairs] = -pairs.row_sums(weights)
    return weights
