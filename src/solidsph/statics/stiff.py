"""Stiff: protocol of loads that depend on the displacement."""

from __future__ import annotations

from typing import Protocol, TypeGuard

from scipy.sparse import csr_array

from solidsph.interfaces.memory import Memory
from solidsph.maths.arrays import Array


class Stiff(Protocol):
    """A Load with a known stiffness.

    Other loads are taken as independent of the displacement. Newton's method then converges to
    the same equilibrium more slowly, or not at all if the load affects stability.
    """

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        """Minus the derivative of `Load.forces` by the displacement, (d n, d n) [N/m].

        Args:
            displacements: u = x - X of all particles, (n, d) [m].
            time: time of the load [s].

        Component i of particle p has the index p d + i. It need not be symmetric. None if zero.
        """


class StiffInSteps(Protocol):
    """A Load with memory whose forces at the end of a step have a known stiffness."""

    def stiffness_of_step(
        self, time: float, step: float, displacements: Array, velocities: Array, memory: Memory
    ) -> csr_array | None:
        """Minus the derivative of the forces of `Load.advance` by the displacement.

        Velocities change with the displacements, by their change over the step, if the load is
        `rate_independent`. The result and the displacements are those of `Stiff.stiffness`, the
        other arguments those of `Load.advance`.
        """


def is_stiff(load: object) -> TypeGuard[Stiff]:
    """Whether a load tells its stiffness; a number of that name is a parameter of its own."""
    return callable(getattr(load, "stiffness", None))


def is_stiff_in_steps(load: object) -> TypeGuard[StiffInSteps]:
    """Whether a load tells the stiffness that its memory leaves it."""
    return callable(getattr(load, "stiffness_of_step", None))
