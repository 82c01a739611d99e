"""Stiff: what a load may tell of itself so that Newton's method can follow it."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from scipy.sparse import csr_array

from solidsph.maths.arrays import Array


@runtime_checkable
class Stiff(Protocol):
    """A Load whose force depends on the displacement.

    A load that does not implement it is taken as constant in displacement: the equilibrium found
    is still the right one, but more slowly, or not at all if that load matters to stability.
    """

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        """Minus the derivative of its force by the displacement, (d n, d n) [N/m]; None if zero.

        Args:
            displacements: u = x - X of all particles, (n, d) [m].
            time: of the load [s].

        Of a force without an energy the symmetric part is enough: Newton's method converges by it.

        Rows and columns stand particle by particle: component i of particle p at p d + i.
        """
