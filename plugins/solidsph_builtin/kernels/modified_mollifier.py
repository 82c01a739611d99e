"""The modified mollifier, the paper's own kernel."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.kernel import Kernel
from solidsph.maths.arrays import Scalar

# Avoids 1 / 0; for smaller 1 - q^2 the profile is far below the smallest double anyway.
_TINY = 1e-9


@final
@attrs.frozen
class ModifiedMollifier(Kernel):
    """w(q) = exp(-1 / (1 - q^2)) (1 - q^2)^8: a Gaussian of smoothing length H / 3 near q = 0,
    smooth to all orders at its edge. Ismail & Reddy, eq. 6.
    """

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        s = np.maximum(1.0 - q * q, _TINY)
        return np.exp(-1.0 / s) * s**8

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        s = np.maximum(1.0 - q * q, _TINY)
        return -2.0 * q * np.exp(-1.0 / s) * (8.0 * s**7 + s**6)
