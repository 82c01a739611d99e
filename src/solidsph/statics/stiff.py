"""Stiff: protocol of loads that depend on the displacement."""

from __future__ import annotations

from typing import Protocol, TypeGuard

from scipy.sparse import csr_array

from solidsph.maths.arrays import Array


class Stiff(Protocol):
    """A Load with a known stiffness.

    Other loads are taken as independent of the displacement. Newton's method then converges to
    the same equilibrium more slowly, or not at all if the load affects stability.
    """

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        """Minus the derivative of its force by the displacement, (d n, d n) [N/m]; None if zero.

        Args:
            displacements: u = x - X of all particles, (n, d) [m].
            time: time of the load [s].

        Component i of particle p has the index p d + i. It need not be symmetric.
        """


def is_stiff(load: object) -> TypeGuard[Stiff]:
    """Whether a load tells its stiffness; a number of that name is a parameter of its own."""
    return callable(getattr(load, "stiffness", None))
