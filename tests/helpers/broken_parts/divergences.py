"""A divergence that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from typing import ClassVar

import attrs
import numpy as np

from solidsph import (
    Divergence,
)
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs


@attrs.frozen
class GoodDivergence(Divergence):
    """d_pq = -V_q g_qp."""

    conserves_momentum: ClassVar[bool] = True
    adjoint: ClassVar[bool] = True
    uses_ghost_stress: ClassVar[bool] = False

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -volumes[pairs.columns, None] * gradient_weights[pairs.reversed_order()]


class MeanForce(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -gradient_weights[pairs.reversed_order()]


class OneForceTooMany(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, gradient_weights, volumes)
        return np.concatenate([weights, weights[:1]])


class Pulling(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -super().weights(pairs, gradient_weights, volumes)


class OwnVolumes(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return volumes[pairs.rows, None] * gradient_weights


class DivergenceInPlace(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, gradient_weights, volumes)
        gradient_weights *= 2.0
        return weights


DIVERGENCES = [
    (OneForceTooMany, {"shape"}),
    (MeanForce, {"area"}),
    (Pulling, {"divergence inside"}),
    (OwnVolumes, {"momentum", "adjoint"}),
    (DivergenceInPlace, {"leaves its input"}),
]
