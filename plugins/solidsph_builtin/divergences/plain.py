"""The paper's divergence."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.divergence import PointwiseDivergence
from solidsph.maths.arrays import Scalar


@final
@attrs.frozen
class Plain(PointwiseDivergence):
    """f_p = V_p sum over q of T_q g_pq without q = p: the sum of Ismail & Reddy, eq. 17.

    A gradient of differences has a weight at q = p. Included, it would make this a sum over
    T_q - T_p, which is not the paper's and hides the tensile instability: a uniform stress would
    exert no force in any arrangement of the particles.
    """

    conserves_momentum: ClassVar[bool] = False
    adjoint: ClassVar[bool] = False
    uses_ghost_stress: ClassVar[bool] = True

    @staticmethod
    def pair_weight(there: Scalar, back: Scalar, volume: Scalar, other: Scalar) -> Scalar:
        return volume * there

    @staticmethod
    def own_weight(own: Scalar, volume: Scalar) -> Scalar:
        return 0.0 * own
