"""A gradient that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from typing import ClassVar

import attrs
import numpy as np

from solidsph import (
    Gradient,
)
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs


@attrs.frozen
class GoodGradient(Gradient):
    """g_pq = dW/dx_p V_q on differences."""

    exact_degree: ClassVar[int] = 0

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights = kernel_gradients * volumes[pairs.columns, None]
        weights[pairs.self_pairs] = -pairs.row_sums(weights)
        return weights


class ClaimsLinear(GoodGradient):
    exact_degree: ClassVar[int] = 1


class ClaimsNothing(GoodGradient):
    exact_degree: ClassVar[int] = -1


class ClaimsConstant(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return kernel_gradients * volumes[pairs.columns, None]


class WithoutVolumes(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return super().weights(pairs, kernel_gradients, np.ones_like(volumes))


class OneTooMany(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, kernel_gradients, volumes)
        return np.concatenate([weights, weights[:1]])


GRADIENTS = [
    (ClaimsLinear, {"exact degree"}),
    (ClaimsConstant, {"exact degree"}),
    (ClaimsNothing, {"no higher degree"}),
    (WithoutVolumes, {"inverse length"}),
    (OneTooMany, {"shape"}),
]
