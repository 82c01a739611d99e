"""The linearly corrected gradient."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.errors import BuildError
from solidsph.interfaces.gradient import Gradient
from solidsph.neighbours import Pairs
from solidsph_builtin.gradients.difference import differences

# Beyond this condition number of the moment matrix, rounding reaches the eighth digit.
_WORST_CONDITION = 1e8


@final
@attrs.frozen
class Corrected(Gradient):
    """grad f_p = sum over q of (f_q - f_p) K_p dW/dx_p V_q, exact for linear fields.

    K_p is the inverse transpose of sum over q of (x_q - x_p) (x) dW/dx_p V_q. Bonet & Lok (1999);
    also Randles & Libersky (1996).
    """

    exact_degree: ClassVar[int] = 1

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        plain = kernel_gradients * volumes[pairs.columns, None]
        moments = pairs.row_sums(pairs.offsets[:, :, None] * plain[:, None, :])
        _check_moments(moments, pairs)
        corrections = np.linalg.inv(moments).transpose(0, 2, 1)
        corrected: Array = np.einsum("mij,mj->mi", pairs.spread(corrections), plain)
        return differences(pairs, corrected)


def _check_moments(moments: Array, pairs: Pairs) -> None:
    singular = ~(np.linalg.cond(moments) < _WORST_CONDITION)
    if singular.any():
        first = int(np.flatnonzero(singular)[0])
        neighbours = int(pairs.starts[first + 1] - pairs.starts[first]) - 1
        worst = int(pairs.rows[pairs.starts[first]])
        raise BuildError(
            [
                f"gradient 'corrected': the {neighbours} neighbours of particle {worst} do not "
                f"span {moments.shape[1]} dimensions ({int(singular.sum())} such particles); "
                "a larger cover or a finer spacing gives them neighbours in every direction"
            ]
        )
