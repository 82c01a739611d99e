"""Terms: boundary handlers and effects once they are bound to particles.

A handler or an effect is a frozen set of parameters. Bound to a model it becomes one or more terms,
which hold arrays. The type of a term is what it does: prescribe motion, change the stress, add
forces, store energy, or show fields. A run calls only the terms that are there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.memory import Memory
from solidsph.interfaces.plan import Operations, SumMethod
from solidsph.interfaces.subset import Subset
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles, State


@attrs.frozen(eq=False)
class Observation:
    """A state with the fields derived from it, as reports and records see it."""

    state: State
    particles: Particles
    masses: Array  # (n,) [kg]
    deformation_gradients: Array  # (n, d, d) F [-]
    stresses: Array  # (n, d, d) first Piola-Kirchhoff stress P [Pa]
    energy_densities: Array  # (n,) psi [J/m^3]
    dissipated_densities: Array | None = None  # (n,) by materials so far [J/m^3]
    # Cache of quantities that several observers need; keys are unique to their owners.
    made: dict[object, Any] = attrs.field(factory=dict, init=False, repr=False)

    @property
    def volume_ratios(self) -> Array:
        """J = det F of every particle, (n,) [-]."""
        if "J" not in self.made:
            with np.errstate(all="ignore"):
                self.made["J"] = np.linalg.det(self.deformation_gradients)
        ratios: Array = self.made["J"]
        return ratios

    @property
    def squared_speeds(self) -> Array:
        """v^2 of every particle, (n,) [m^2/s^2]."""
        if "v^2" not in self.made:
            self.made["v^2"] = np.sum(self.state.velocities**2, axis=1)
        squares: Array = self.made["v^2"]
        return squares


class Term(ABC):
    """Something that acts on some of the particles."""

    @property
    @abstractmethod
    def label(self) -> str:
        """Name of its account in energies, reports and errors."""

    def report(self, observation: Observation) -> Mapping[str, float]:
        """Numbers "quantity [unit]" for the report, such as what was asked for and achieved."""
        return {}


class EnergyTerm(Term):
    """A term that stores energy besides the strain energy."""

    @abstractmethod
    def energies(self, observation: Observation) -> Array:
        """Energy stored per particle, (n,) [J]: minus the work done since it was zero."""


class FieldTerm(Term):
    """A term with fields for the record."""

    @abstractmethod
    def fields(self, observation: Observation) -> Mapping[str, Array]:
        """Fields "quantity [unit]" of all particles, ghosts included.

        Each is (n,), (n, d) or (n, d, d), and every observation has the same ones.
        """


class Constraint(Term):
    """A term that prescribes the motion of some degrees of freedom."""

    @property
    @abstractmethod
    def held(self) -> Mask:
        """True for the degrees of freedom that it prescribes, (n, d)."""

    @abstractmethod
    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        """Overwrite the held entries of `values` in place.

        Args:
            time: [s].
            derivative: 0 if `values` are displacements u = x - X, 1 if velocities, 2 if
                accelerations.
            values: (n, d).
            step: time step of the run, over which derivatives may be differences [s].
        """

    def part(self, subset: Subset, held: Mask) -> Constraint | None:
        """The constraint on a subset, without the particles that are `held` (n,) otherwise.

        None, the default, if it cannot act on a subset.
        """
        return None


class GhostConstraint(Constraint):
    """A constraint that makes ghosts follow other particles linearly, u_ghost = E u."""

    @abstractmethod
    def return_forces(self, forces: Array) -> None:
        """Move the forces on ghosts to the particles they follow, in place: f += E^T f_ghost.

        With the transpose the forces are the derivative of the energy by the free motion alone.

        Args:
            forces: on all particles, (n, d) [N].
        """


class StressTerm(Term):
    """A term that prescribes the stress of some particles, ghosts included."""

    @abstractmethod
    def impose_stress(self, time: float, stress: Array) -> None:
        """Overwrite entries of `stress` (d, d, n) [Pa] in place, after the material's law."""


class Load(Term):
    """A term that adds forces to some particles."""

    supports: ClassVar[float] = 2.0
    """Distance, in support radii, of the particles on which its forces depend."""

    @property
    @abstractmethod
    def particles(self) -> Indices:
        """Particles on which it acts, (k,)."""

    @abstractmethod
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        """Forces on these particles, (k, d) [N], from positions and velocities (n, d) of all."""

    is_counted: ClassVar[bool] = False
    """True if `operations` is the complete cost of an evaluation; other loads are timed."""

    acts_always: ClassVar[bool] = False
    """True if its stiffness is there in every state, so that the spectrum of a scene shows it. For
    other loads, such as contact, the stable step adds what `stiffness_rate` declares."""

    rate_independent: ClassVar[bool] = False
    """True if velocities count for it only as motion within a step, as for friction. In an
    equilibrium it gets those of a load step, where others are at rest."""

    @property
    def stiffness_rate(self) -> float:
        """Highest angular frequency that its stiffness adds [rad/s]; for the stable step."""
        return 0.0

    @property
    def damping_rate(self) -> float:
        """Highest rate at which it damps velocities [1/s]; for the stable step."""
        return 0.0

    @property
    def arrays(self) -> Mapping[str, int]:
        """Sizes of the arrays that it keeps, by name [bytes]."""
        return {}

    @property
    def pair_count(self) -> int:
        """Number of pairs that one evaluation of its forces visits."""
        return 0

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        """Operations of one evaluation, from which its cost is predicted.

        Args:
            dimension: of the scene.
            compiled: True if whole steps are compiled.
        """
        count = len(self.particles)
        kept = sum(self.arrays.values()) or 8 * count * dimension
        touched = kept + 3 * 8 * count * dimension
        return (Operations(SumMethod.UNKNOWN, self.pair_count, count, touched, kept),)

    def part(self, subset: Subset) -> Load | None:
        """The load on a subset of the particles; None, the default, if it cannot act on one."""
        return None

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        """Forces (k, d) [N] at the end of a step, and what is to be remembered of it.

        A load with memory overrides this. It reads and returns entries whose names begin with its
        label; where it finds none, the run begins.

        Args:
            time: end of the step [s].
            step: length of the step [s]; 0 if no step is made, and then memory must not change.
            positions: at its end, of all particles, (n, d) [m].
            velocities: at its end, (n, d) [m/s].
            memory: `State.memory` at its beginning.
        """
        return self.forces(time, positions, velocities), {}


class SurfaceLoad(Load):
    """A load that is the natural boundary condition of the weak form on a surface.

    It cannot be combined with ghosts that continue the stress beyond that surface: together they
    would leave nothing to balance the load.
    """
