"""Room: the volume fraction that the other body may fill around a particle without a force."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.effects._contact_passes import Passes
from solidsph_builtin.effects._search import Candidates
from solidsph_builtin.effects._sites import FilledBeside

# Bound on the relative rounding of sums of the same terms, in another order or after a translation.
_ROUNDING = 1e-9


@attrs.frozen(eq=False)
class Near:
    """Pairs within reach, and how much of one there is around the other."""

    i: Indices  # (k,)
    j: Indices  # (k,)
    offsets: Array  # (k, d) x_i - x_j [m]
    values: Array  # (k,) W [m^-d]
    slopes: Array  # (k,) dW/dr / r [m^-(d+2)]
    found: Candidates  # some of which these are
    places: Indices  # (k,) which ones

    @property
    def reaches(self) -> Array:
        """H of each, (k,) [m]."""
        return np.asarray(self.found.reaches[self.places])

    @property
    def brought(self) -> tuple[Array, ...]:
        """What these pairs bring to the room, each (k,)."""
        return tuple(values[self.places] for values in self.found.brought)


@attrs.frozen(eq=False)
class Excess:
    """The volume fraction of the other body beyond the room, o, and its derivatives.

    That of o_i by W_ij is V_j times the factor of i.
    """

    excess: Array  # (m,) o [-]
    factors: tuple[Array | float, Array | float]  # (k,) of i and of j [-]; 1 if room is constant
    slopes: tuple[Array, Array]  # (k,) these times dW/dr / r [m^-(d+2)]
    # (m,) 1 / S where there is an excess, by which factors change [-]; None if they are constant
    bend: Array | None


class Room(ABC):
    """The room of the particles (m,) of a meeting."""

    @abstractmethod
    def brought(self, i: Indices, j: Indices, reaches: Array) -> tuple[Array, ...]:
        """What pairs with these `reaches` (k,) [m] bring to it, (k,) each; it does not change."""

    @abstractmethod
    def excess(self, passes: Passes, volumes: Array, near: Near) -> Excess:
        """What is beyond the room, at pairs `near`."""

    @abstractmethod
    def at_least(self, passes: Passes, volumes: Array, near: Near) -> Room:
        """The room that is never below what there is at pairs `near`."""


@final
@attrs.frozen(eq=False)
class ConstantRoom(Room):
    """That of bodies of one spacing each."""

    room: Array  # (m,) [-]

    def brought(self, i: Indices, j: Indices, reaches: Array) -> tuple[Array, ...]:
        return ()

    def excess(self, passes: Passes, volumes: Array, near: Near) -> Excess:
        filled = passes.filled(near.i, near.j, near.values, volumes)
        excess = np.maximum(filled - self.room, 0.0)
        return Excess(excess, (1.0, 1.0), (near.slopes, near.slopes), None)

    def at_least(self, passes: Passes, volumes: Array, near: Near) -> Room:
        filled = passes.filled(near.i, near.j, near.values, volumes)
        return ConstantRoom(np.maximum(self.room, (1.0 + _ROUNDING) * filled))


@final
@attrs.frozen(eq=False)
class MeanRoom(Room):
    """That of bodies whose spacing varies: the mean of what the other's particles nearby leave.

    Each b leaves a the room R_ab, the volume fraction at a of a plane face that lies on the
    surface of A and has the rows beside b everywhere. The mean is weighted by what b contributes to
    the volume fraction S_a, so that the excess is

        o_a = S_a - Q_a / S_a,   S_a = sum of V_b W_ab,   Q_a = sum of V_b W_ab R_ab,

    a function of distances alone. Its derivative by W_ab is V_b (1 + (Q_a / S_a - R_ab) / S_a).
    """

    depths: Array  # (m,) below the surface of their body [m]
    spacings: Array  # (m,) s [m]
    first_row: Array  # (m,) thickness of the first row of their body there [s]
    bodies: Sequence[FilledBeside]  # that of i and that of j
    extra: Array  # (m,) beyond the mean [-]

    def brought(self, i: Indices, j: Indices, reaches: Array) -> tuple[Array, ...]:
        first, second = self.bodies
        return (
            second.at(self.depths[i], self.spacings[j], self.first_row[j], reaches),
            first.at(self.depths[j], self.spacings[i], self.first_row[i], reaches),
        )

    def excess(self, passes: Passes, volumes: Array, near: Near) -> Excess:
        of_i, of_j = near.brought
        filled, mean = self._means(passes, volumes, near, of_i, of_j)
        excess = np.maximum(filled - mean - self.extra, 0.0)
        inverse = np.divide(1.0, filled, out=np.zeros_like(filled), where=excess > 0.0)
        factors = (
            1.0 + (mean[near.i] - of_i) * inverse[near.i],
            1.0 + (mean[near.j] - of_j) * inverse[near.j],
        )
        slopes = factors[0] * near.slopes, factors[1] * near.slopes
        return Excess(excess, factors, slopes, inverse)

    def at_least(self, passes: Passes, volumes: Array, near: Near) -> Room:
        filled, mean = self._means(passes, volumes, near, *near.brought)
        return attrs.evolve(self, extra=np.maximum((1.0 + _ROUNDING) * filled - mean, 0.0))

    @staticmethod
    def _means(
        passes: Passes, volumes: Array, near: Near, of_i: Array, of_j: Array
    ) -> tuple[Array, Array]:
        """S and Q / S of all particles, (m,) and (m,) [-]."""
        filled = passes.filled(near.i, near.j, near.values, volumes)
        total = passes.left(near.i, near.j, near.values, volumes, of_i, of_j)
        return filled, np.divide(total, filled, out=np.zeros_like(total), where=filled > 0.0)
