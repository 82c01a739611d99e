"""A kernel that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from math import exp
from typing import ClassVar

import attrs
import numpy as np

from solidsph import (
    Kernel,
)
from solidsph.maths.arrays import Scalar


@attrs.frozen
class GoodKernel(Kernel):
    """w = (1 - q)^4 (1 + 4 q)."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q)


class NegativeLobe(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) * (1.0 - 3.0 * q**2)


class WrongSlope(GoodKernel):
    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return -20.0 * q * (1.0 - q) ** 3 * (1.0 + 1e-9 * q)


class UnseenBySteps(GoodKernel):
    """`abs` throws the imaginary part away, so a complex step finds no slope."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return np.abs(1.0 - q) ** 4 * (1.0 + 4.0 * q)


class WrongNormalisation(GoodKernel):
    def closed_normalisation(self, dimension: int) -> float:
        return {1: 5.0 / 4.0, 2: 7.0 / np.pi, 3: 21.0 / (2.0 * np.pi)}[dimension]


class CutUndeclared(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return np.exp(-4.0 * q * q)


class CutDeclaredWrongly(CutUndeclared):
    def lost_mass(self, dimension: int) -> float:
        return exp(-4.0)  # true in two dimensions only


class LossWithoutCut(GoodKernel):
    def lost_mass(self, dimension: int) -> float:
        return 1e-4


class Rising(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q + 20.0 * q * q)


class Pointed(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return 1.0 - q


class UndeclaredKnot(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) + np.maximum(0.3 - q, 0.0) ** 2


class NotPointwise(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) * (1.0 + 1e-3 * np.ndim(q))


class ManyNegative(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 2 * (1.0 + 2.0 * q) * (1.0 - 5.0 * q**2)


class ClaimsToNeverPair(GoodKernel):
    """A parabola, whose transform oscillates."""

    nonnegative_transform: ClassVar[bool] = True

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return 1.0 - q**2


KERNELS = [
    (WrongSlope, {"gradient moment"}),
    (ManyNegative, {"moments"}),
    (ClaimsToNeverPair, {"transform"}),
    (NegativeLobe, {"not negative", "falling", "mass", "support", "scaling"}),
    (WrongSlope, {"slope"}),
    (UnseenBySteps, {"slope"}),
    (WrongNormalisation, {"closed normalisation", "mass"}),
    (CutUndeclared, {"declared loss"}),
    (CutDeclaredWrongly, {"declared loss"}),
    (LossWithoutCut, {"declared loss"}),
    (Rising, {"falling"}),
    (Pointed, {"smooth centre"}),
    (UndeclaredKnot, {"mass"}),
    (NotPointwise, {"pointwise"}),
]
