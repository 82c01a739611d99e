"""The classical mollifier of distribution theory."""

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
class Mollifier(Kernel):
    """w(q) = exp(-1 / (1 - q^2)). Ismail & Reddy, below eq. 6."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return np.exp(-1.0 / np.maximum(1.0 - q * q, _TINY))

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        s = np.maximum(1.0 - q * q, _TINY)
        return -2.0 * q * np.exp(-1.0 / s) / s**2
