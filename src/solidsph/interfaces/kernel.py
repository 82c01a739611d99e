"""Kernel: the weight of a neighbour as a function of its distance."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Scalar


class Kernel(Part):
    """A radial profile w(q) on 0 <= q < 1, where q = r / H is distance over support radius.

    The author writes the formula only. The core finds the constant that gives the kernel unit mass
    in 1, 2 and 3 dimensions, cuts it off at q = 1, guards r = 0 and forms gradients. `profile` and
    `slope` are pure pointwise functions: q is a number or an array.

    An implementation is a frozen attrs class; the numbers that it needs are its fields, handed to
    the pointwise functions through `params`.
    """

    knots: ClassVar[tuple[float, ...]] = ()
    """Values of q inside (0, 1) where the profile is less smooth (spline joints); quadrature
    splits its panels there."""

    nonnegative_transform: ClassVar[bool] = False
    """True if the Fourier transform of W is nonnegative in 1, 2 and 3D: particles then do not
    pair, for any number of neighbours (Dehnen & Aly 2012)."""

    @property
    def params(self) -> tuple[float, ...]:
        """Numbers passed on to `profile` and `slope`."""
        return ()

    @staticmethod
    @abstractmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        """w(q) without normalisation: finite, not negative, and zero at q = 1."""

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar | None:
        """dw/dq, or None to let the core differentiate `profile`.

        It then takes a complex step, for which the profile must be analytic (no `abs`) between its
        knots.
        """
        return None

    def closed_normalisation(self, dimension: int) -> float | None:
        """The constant that gives unit mass with H = 1, if it is known; the core checks it."""
        return None

    def lost_mass(self, dimension: int) -> float:
        """Mass lost because the support is cut where the profile is not yet zero.

        Zero for a compact kernel. A kernel whose profile does not vanish at q = 1 must declare a
        positive loss; its mass is then 1 minus this.
        """
        return 0.0
