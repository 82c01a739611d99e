"""The plain gradient applied to differences."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.gradient import PointwiseGradient


@final
@attrs.frozen
class Difference(PointwiseGradient):
    """grad f_p = sum over q of (f_q - f_p) dW/dx_p V_q: the gradient of a constant is zero.

    Equal to the standard one where supports are complete, and unlike it independent of where the
    body stands, which the updated Lagrangian form needs: there, moved neighbours unbalance the
    weights.
    """

    exact_degree: ClassVar[int] = 0
    of_differences: ClassVar[bool] = True
