"""The divergence that belongs to the discrete energy."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.divergence import PointwiseDivergence
from solidsph.maths.arrays import Scalar


@final
@attrs.frozen
class Variational(PointwiseDivergence):
    """f_p = - sum over q of V_q T_q g_qp: minus the transpose of the gradient, weighted by volume.

    In the total Lagrangian form this is the exact derivative of the discrete strain energy
    sum of V psi(F), so energy is kept, and momentum whenever a constant has gradient zero. With
    the linearly corrected gradient it is the usual symmetric pair force (Bonet & Lok 1999); with
    the standard gradient it is the same as the plain divergence.
    """

    conserves_momentum: ClassVar[bool] = True
    adjoint: ClassVar[bool] = True
    uses_ghost_stress: ClassVar[bool] = False

    @staticmethod
    def pair_weight(there: Scalar, back: Scalar, volume: Scalar, other: Scalar) -> Scalar:
        return -other * back

    @staticmethod
    def own_weight(own: Scalar, volume: Scalar) -> Scalar:
        return -volume * own
