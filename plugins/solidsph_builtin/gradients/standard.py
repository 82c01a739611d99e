"""The plain SPH gradient of the paper."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.gradient import PointwiseGradient


@final
@attrs.frozen
class Standard(PointwiseGradient):
    """g_pq = dW(x_p - x_q)/dx_p V_q. Ismail & Reddy, eqs. 5, 10 and 16.

    Needs complete supports: near a surface without ghosts not even a constant is exact.
    """

    exact_degree: ClassVar[int] = -1
    of_differences: ClassVar[bool] = False
