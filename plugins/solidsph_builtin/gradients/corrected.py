"""The linearly corrected gradient."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.gradient import PointwiseGradient
from solidsph.maths.arrays import Tensor
from solidsph.maths.tensors import contraction, inverse_transpose, scale

# Beyond this condition number of the moment matrix, rounding reaches the eighth digit.
_WORST_CONDITION = 1e8


@final
@attrs.frozen
class Corrected(PointwiseGradient):
    """grad f_p = sum over q of (f_q - f_p) K_p dW/dx_p V_q, exact for linear fields.

    K_p is the inverse transpose of sum over q of (x_q - x_p) (x) dW/dx_p V_q. Bonet & Lok (1999);
    also Randles & Libersky (1996).
    """

    exact_degree: ClassVar[int] = 1
    of_differences: ClassVar[bool] = True

    @staticmethod
    def correction(moment: Tensor) -> Tensor:
        K = inverse_transpose(moment)
        condition = np.sqrt(contraction(moment, moment) * contraction(K, K))
        # A factor 1 where K is accurate, infinite elsewhere.
        return scale(1.0 / (condition < _WORST_CONDITION), K)
