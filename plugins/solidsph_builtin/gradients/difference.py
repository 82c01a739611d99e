"""The plain gradient applied to differences."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.gradient import PointwiseGradient


@final
@attrs.frozen
class Difference(PointwiseGradient):
    """grad f_p = sum over q of (f_q - f_p) dW/dx_p V_q: the gradient of a constant is zero.

    It equals the standard gradient where supports are complete. Unlike that, it does not depend on
    the position of the body, as the updated Lagrangian form requires: there, moved neighbours
    unbalance the weights.
    """

    exact_degree: ClassVar[int] = 0
    of_differences: ClassVar[bool] = True
