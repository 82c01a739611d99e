"""The paper's divergence."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.arrays import Array
from solidsph.interfaces.divergence import Divergence
from solidsph.neighbours import Pairs


@final
@attrs.frozen
class Plain(Divergence):
    """f_p = V_p sum over q of T_q g_pq without q = p: the sum of Ismail & Reddy, eq. 17.

    A gradient of differences has a weight at q = p; left in, it would make this a sum over
    T_q - T_p, which is not the paper's and hides the tensile instability: a uniform stress would
    exert no force however the particles are arranged.
    """

    conserves_momentum: ClassVar[bool] = False
    adjoint: ClassVar[bool] = False
    uses_ghost_stress: ClassVar[bool] = True

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = volumes[pairs.rows, None] * gradient_weights
        weights[pairs.self_pairs] = 0.0
        return weights
