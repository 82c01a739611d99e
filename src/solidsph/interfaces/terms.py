"""Conditions: boundary handlers and effects once they are bound to particles.

A handler or an effect is a frozen set of parameters; bound to a model it becomes one or more
conditions that hold arrays. What a condition can do is its type: determine motion, change the
stress, add forces, or show fields. A run calls only those that are there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.plan import Operations, SumMethod
from solidsph.interfaces.subset import Subset
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles, State


@attrs.frozen(eq=False)
class Observation:
    """A state with the fields that belong to it, as reports and records see it."""

    state: State
    particles: Particles
    masses: Array  # (n,) [kg]
    deformation_gradients: Array  # (n, d, d) F [-]
    stresses: Array  # (n, d, d) first Piola-Kirchhoff stress P [Pa]
    energy_densities: Array  # (n,) psi [J/m^3]
    dissipated_densities: Array | None = None  # (n,) by materials so far [J/m^3]
    # What several listeners need, made once by keys of theirs.
    made: dict[object, Any] = attrs.field(factory=dict, init=False, repr=False)

    @property
    def volume_ratios(self) -> Array:
        """J = det F of every particle, (n,)."""
        if "J" not in self.made:
            with np.errstate(all="ignore"):
                self.made["J"] = np.linalg.det(self.deformation_gradients)
        found: Array = self.made["J"]
        return found

    @property
    def squared_speeds(self) -> Array:
        """v^2 of every particle, (n,) [m^2/s^2]."""
        if "v^2" not in self.made:
            self.made["v^2"] = np.sum(self.state.velocities**2, axis=1)
        found: Array = self.made["v^2"]
        return found


class Term(ABC):
    """Something imposed on some of the particles."""

    @property
    @abstractmethod
    def label(self) -> str:
        """Name of its account in energies, reports and errors."""

    @abstractmethod
    def report(self, observation: Observation) -> Mapping[str, float]:
        """What was asked for and what was achieved: columns "quantity [unit]" of numbers."""


class EnergyTerm(Term):
    """Stores energy beside that of the strain."""

    @abstractmethod
    def energies(self, observation: Observation) -> Array:
        """What it stores of every particle, (n,) [J]: minus its work, from where it was zero."""


class FieldTerm(Term):
    """Has something to show of every particle."""

    @abstractmethod
    def fields(self, observation: Observation) -> Mapping[str, Array]:
        """Fields "quantity [unit]" for the record, of all particles, ghosts among them.

        Each is (n,), (n, d) or (n, d, d), and the same ones are there in every observation.
        """


class Constraint(Term):
    """Determines the motion of some degrees of freedom."""

    @property
    @abstractmethod
    def held(self) -> Mask:
        """Degrees of freedom that this condition determines, (n, d)."""

    @abstractmethod
    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        """Overwrite the held entries of `values` (n, d) in place.

        Args:
            time: [s].
            derivative: 0 if `values` are displacements u = x - X, 1 if velocities, 2 if
                accelerations.
            values: (n, d).
            step: time step of the run, over which derivatives may be differences [s].
        """

    def part(self, subset: Subset, held: Mask) -> Constraint | None:
        """The same for a subset of the particles, without those that are `held` (n,) otherwise;
        None if it cannot act on some particles alone."""
        return None


class GhostConstraint(Constraint):
    """Makes ghosts follow other particles, linearly: u_ghost = E u."""

    @abstractmethod
    def return_forces(self, forces: Array) -> None:
        """Move the forces (n, d) on the ghosts to those they follow, in place: f += E^T f_ghost.

        The transpose makes the forces the derivative of the energy by the free motion alone.
        """


class StressTerm(Term):
    """Determines the stress of some particles, ghosts among them."""

    @abstractmethod
    def impose_stress(self, time: float, stress: Array) -> None:
        """Overwrite entries of `stress` (d, d, n) [Pa] in place, after the material's law."""


class Load(Term):
    """Adds forces to some particles."""

    supports: ClassVar[float] = 2.0
    """How far away, in support radii, the particles are on which its forces depend."""

    @property
    @abstractmethod
    def particles(self) -> Indices:
        """Those that it acts on, (k,)."""

    @abstractmethod
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        """Forces on these particles, (k, d) [N], from positions and velocities (n, d) of all."""

    is_counted: ClassVar[bool] = False
    """True if `operations` say all that an evaluation costs; other loads are timed."""

    @property
    def stiffness_rate(self) -> float:
        """Angular frequency that its stiffness adds at most [rad/s]; for the stable step."""
        return 0.0

    @property
    def damping_rate(self) -> float:
        """Largest rate at which it damps velocities [1/s]; for the stable step."""
        return 0.0

    @property
    def arrays(self) -> Mapping[str, int]:
        """Sizes of the arrays that it keeps, by name [bytes]."""
        return {}

    @property
    def pair_count(self) -> int:
        """Pairs of particles that an evaluation of its forces visits."""
        return 0

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        """What an evaluation passes over, for those who count and price it.

        Args:
            dimension: of the scene.
            compiled: True if whole steps are compiled.
        """
        count = len(self.particles)
        kept = sum(self.arrays.values()) or 8 * count * dimension
        touched = kept + 3 * 8 * count * dimension
        return (Operations(SumMethod.UNKNOWN, self.pair_count, count, touched, kept),)

    def part(self, subset: Subset) -> Load | None:
        """The same load on a subset of the particles; None if it cannot act on some alone."""
        return None

    def advance(
        self,
        time: float,
        step: float,
        positions: Array,
        velocities: Array,
        memory: Mapping[str, Array],
    ) -> tuple[Array, Mapping[str, Array]]:
        """The forces at the end of a step, and what is to be remembered of it.

        What remembers overrides this: it reads `memory`, that of the state before the step, under
        names that begin with its label, and returns under them what the next step will read. Where
        nothing is there yet, the run begins. `step` is the length of the step [s]; 0 if none is
        made, and then nothing may change.
        """
        return self.forces(time, positions, velocities), {}


class SurfaceLoad(Load):
    """Forces that are the weak form's natural condition of a surface.

    They do not go with ghosts that continue the stress beyond that surface: the two together
    would leave nothing to balance the load.
    """
