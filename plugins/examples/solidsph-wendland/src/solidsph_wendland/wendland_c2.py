"""Wendland's C2 kernel."""

from __future__ import annotations

from math import pi
from typing import ClassVar, final

import attrs

from solidsph.parts import Kernel, Scalar


@final
@attrs.frozen
class WendlandC2(Kernel):
    """w(q) = (1 - q)^4 (1 + 4 q). Wendland (1995); Dehnen & Aly (2012).

    This is Wendland's function of two and three dimensions; it serves in one as well, where his
    own would be (1 - q)^3 (1 + 3 q).
    """

    nonnegative_transform: ClassVar[bool] = True

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q)

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return -20.0 * q * (1.0 - q) ** 3

    def closed_normalisation(self, dimension: int) -> float:
        return {1: 3.0 / 2.0, 2: 7.0 / pi, 3: 21.0 / (2.0 * pi)}[dimension]
