"""Engine: how the sums over neighbours are carried out. Nothing else loops over pairs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import attrs

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.interfaces.condition import StressCondition


@attrs.frozen(eq=False)
class StressFields:
    """What the material says at every particle; ghosts show F = I and no stress of their own."""

    deformation_gradients: Array  # (n, d, d) F [-]
    stresses: Array  # (n, d, d) first Piola-Kirchhoff stress P [Pa]
    energy_densities: Array  # (n,) psi [J/m^3]


class InternalForces(ABC):
    """The forces that bodies exert on themselves, as a function of where their particles are."""

    @property
    @abstractmethod
    def pair_count(self) -> int:
        """Ordered pairs of neighbours that one evaluation sums over, self pairs included."""

    @abstractmethod
    def forces(self, time: float, displacements: Array) -> Array:
        """Force on every particle, (n, d) [N], from displacements u = x - X (n, d) [m]."""

    @abstractmethod
    def fields(self, displacements: Array) -> StressFields:
        """Deformation, stress and energy at the same displacements, for reports and records."""


class Engine(ABC):
    """Prepares bodies for fast evaluation; owns whatever arrays that takes."""

    @abstractmethod
    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressCondition]
    ) -> InternalForces:
        """The internal forces of `bodies`, which together hold all particles, in order.

        Raises:
            BuildError: a formulation's operators cannot be formed on these particles.
        """
