"""The Gaussian, cut where it is small."""

from __future__ import annotations

from math import erf, exp, pi, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.kernel import Kernel
from solidsph.maths.arrays import Scalar
from solidsph.registry.parameters import number


@final
@attrs.frozen
class Gaussian(Kernel):
    """w(q) = exp(-(k q)^2), cut at k smoothing lengths. Ismail & Reddy, Fig. 1, before the cut.

    It keeps the normalisation of the whole Gaussian, so the mass beyond the cut is lost:
    2.2e-5, 1.2e-4 and 4.4e-4 in 1, 2 and 3 dimensions at the default cut.
    """

    cut: float = number(default=3.0)  # k [-]

    def __attrs_post_init__(self) -> None:
        if not 1.0 <= self.cut <= 6.0:
            raise SceneError(
                f"kernel 'gaussian': cut must be 1 to 6 smoothing lengths, got {self.cut}; "
                "beyond 6 the mass outside is below rounding"
            )

    @property
    def params(self) -> tuple[float, ...]:
        return (self.cut,)

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        (k,) = params
        return np.exp(-((k * q) ** 2))

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        (k,) = params
        return -2.0 * k * k * q * np.exp(-((k * q) ** 2))

    def closed_normalisation(self, dimension: int) -> float:
        return (self.cut / sqrt(pi)) ** dimension

    def lost_mass(self, dimension: int) -> float:
        k = self.cut
        if dimension == 1:
            return 1.0 - erf(k)
        if dimension == 2:
            return exp(-k * k)
        return 1.0 - erf(k) + 2.0 * k / sqrt(pi) * exp(-k * k)
