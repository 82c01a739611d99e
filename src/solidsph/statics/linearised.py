"""Linearised: the tangent stiffness at one configuration, ready to be solved with."""

from __future__ import annotations

from abc import ABC, abstractmethod

from solidsph.errors import PortableError
from solidsph.maths.arrays import Array
from solidsph.statics.increment import Increment
from solidsph.statics.lead import Lead


class UnsolvedError(PortableError):
    """An iteration ends before the forces are balanced."""

    def __init__(self, left: float, iterations: int) -> None:
        self.left = left
        self.iterations = iterations
        super().__init__(f"{iterations} iterations leave {left:.3g} of the forces")


class Linearised(ABC):
    """Minus the derivative of the forces on the k free displacements, at one configuration."""

    @property
    @abstractmethod
    def support(self) -> Array:
        """Stiffness that was added to each of them for want of its own, (k,) [N/m]."""

    @property
    @abstractmethod
    def diagonal(self) -> Array:
        """Its diagonal, (k,) [N/m]; an estimate suffices."""

    @abstractmethod
    def pull(self, motion: Array) -> Array:
        """Force on the free displacements, (k,) [N], that resists a motion (n, d) [m] of all."""

    @abstractmethod
    def solve(self, forces: Array, tolerance: float) -> Array:
        """Free displacements (k,) [m] under `forces` (k,) [N].

        Args:
            forces: on the free displacements.
            tolerance: norm of what may be left of the forces, over their own [-].

        Raises:
            SingularError: some motion has no stiffness.
            UnsolvedError: an iteration does not reach the tolerance.
        """

    @abstractmethod
    def roughly(self, forces: Array) -> Array:
        """About the solution, (k,) [m], good enough to compare sizes."""

    @abstractmethod
    def positive(self) -> bool:
        """Whether it resists every motion: the equilibrium is stable then."""


class LinearSolver(ABC):
    """A way to solve with the tangent stiffness of a scene."""

    @property
    def products(self) -> int:
        """Products with the tangent so far; 0, the default, if it is factorised."""
        return 0

    @abstractmethod
    def lowest_modes(
        self, displacements: Array, masses: Array, shift: float, count: int
    ) -> tuple[Array, Array]:
        """The lowest modes (k, count) with the squares of their frequencies (count,) [1/s^2].

        Args:
            displacements: about which the body vibrates, (n, d) [m].
            masses: of the free displacements, (k,) [kg].
            shift: square of a low frequency, below which rigid motions may be [1/s^2].
            count: number of modes.

        Raises:
            SingularError: some motion falls faster than the shift.
            UnsolvedError: an iteration does not converge.
        """

    @abstractmethod
    def linearised(
        self, displacements: Array, lead: Lead | None, increment: Increment, support: float = 0.0
    ) -> Linearised:
        """The tangent at displacements (n, d) [m].

        Args:
            displacements: u = x - X of all particles.
            lead: of the step that led there, whose prediction the moduli are taken at.
            increment: the load step.
            support: stiffness added to every free displacement, over its own [-].

        Raises:
            SingularError: some motion has no stiffness.
        """
