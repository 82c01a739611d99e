"""Terms described by arrays and pointwise formulas.

A term may be any code that the time loop calls. A term of one of these kinds is described by arrays
and a pointwise formula instead; what the interface asks of it follows here, and an engine can
compile it into its own loop.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Protocol, final

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, kron

from solidsph.interfaces.body import Body
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassProducts
from solidsph.interfaces.pair_table import PairTable
from solidsph.interfaces.plan import Operations, SumMethod
from solidsph.interfaces.subset import Subset
from solidsph.interfaces.terms import Constraint, GhostConstraint, Load, StressTerm
from solidsph.maths.arrays import Array, Indices, Mask, Scalar, Tensor, Vector
from solidsph.maths.tensors import add, identity


class ScheduledConstraint(Constraint):
    """A motion that is a function of time alone."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """(n, d) for all particles."""

    @property
    @abstractmethod
    def entries(self) -> tuple[Indices, Indices]:
        """Particle (m,) and axis (m,) of every degree of freedom that it prescribes."""

    @abstractmethod
    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        """Values of these entries at `times` (t,) [s], (t, m), or (1, m) if they are constant.

        Args:
            times: [s].
            derivative: 0 for displacements, 1 for velocities, 2 for accelerations.
            step: time step of the run, over which derivatives may be differences [s].
        """

    @property
    def held(self) -> Mask:
        held = np.zeros(self.shape, dtype=np.bool_)
        held[self.entries] = True
        return held

    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[self.entries] = self.schedule(np.array([time]), derivative, step)[0]

    def part(self, subset: Subset, held: Mask) -> ScheduledConstraint:
        particles, axes = self.entries
        kept = np.flatnonzero((subset.places[particles] >= 0) & ~held[particles])
        entries = subset.places[particles[kept]], axes[kept]
        shape = len(subset.particles), self.shape[1]
        return _PartOfConstraint(self.label, self, kept, entries, shape)


class LinearExtension(GhostConstraint, StressTerm):
    """Ghosts whose values are linear combinations of those of others, component by component.

    u_i = s_i A u_i and T_ik = s_i s_k B T_ik, with signs s that mirror components.
    """

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """(n, d) for all particles."""

    @property
    @abstractmethod
    def ghosts(self) -> Indices:
        """Ghosts that follow, (k,)."""

    @property
    @abstractmethod
    def displacement(self) -> csr_array:
        """Weights A of displacements, (k, n)."""

    @property
    @abstractmethod
    def stress(self) -> csr_array:
        """Weights B of stresses, (k, n)."""

    @property
    @abstractmethod
    def signs(self) -> Array:
        """Signs s, (k, d)."""

    @property
    def held(self) -> Mask:
        held = np.zeros(self.shape, dtype=np.bool_)
        held[self.ghosts] = True
        return held

    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[self.ghosts] = self.signs * (self.displacement @ values)

    def return_forces(self, forces: Array) -> None:
        forces += self.displacement.T @ (self.signs * forces[self.ghosts])
        forces[self.ghosts] = 0.0

    def impose_stress(self, time: float, stress: Array) -> None:
        for i, row in enumerate(stress):
            for k, component in enumerate(row):
                sign = self.signs[:, i] * self.signs[:, k]
                component[self.ghosts] = sign * (self.stress @ component)


class ScheduledLoad(Load):
    """Forces that are a function of time alone."""

    is_counted: ClassVar[bool] = True

    @abstractmethod
    def schedule(self, times: Array) -> Array:
        """Forces on its particles at `times` (t,) [s], (t, k, d) [N], or (1, k, d) if constant."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        forces: Array = self.schedule(np.array([time]))[0]
        return forces

    def part(self, subset: Subset) -> Load:
        return _PartOfScheduled(self.label, self, *subset.kept(self.particles))


class PointwiseLoad(Load):
    """Forces on particles as a formula of their own position and velocity."""

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def values(self) -> Array:
        """Numbers of each of its particles that the formula uses, (k, m)."""

    @staticmethod
    @abstractmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        """Force [N], a tuple of components; each argument is indexed by component."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        x, v = positions[self.particles], velocities[self.particles]
        components = self.force(x.T, v.T, self.values.T)
        return np.column_stack([np.broadcast_to(c, len(x)) for c in components])

    @property
    def arrays(self) -> Mapping[str, int]:
        return {"chosen particles": self.particles.nbytes, "values": self.values.nbytes}

    def part(self, subset: Subset) -> Load:
        kept, particles = subset.kept(self.particles)
        return _PartOfPointwise(self.label, particles, self.values[kept], self.force)


class PairLoad(Load):
    """Forces along the line between two particles, opposite at its ends.

    They conserve momentum and angular momentum to rounding, whatever the formula.
    """

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def pairs(self) -> PairTable:
        """Interacting pairs, in rows of all n particles."""

    @staticmethod
    @abstractmethod
    def pull(offset: Vector, velocity: Vector, values: Vector) -> Scalar:
        """Force on p divided by the offset x_q - x_p, along which it acts [N/m]; pointwise.

        It is the same for the pair (q, p), whose offset and velocity are opposite: a compiled loop
        asks once a pair.

        Args:
            offset: x_q - x_p [m].
            velocity: v_q - v_p [m/s].
            values: numbers of the pair.
        """

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.pairs.starts) - 1)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        p, q = self.pairs.rows, self.pairs.columns
        offsets = positions[q] - positions[p]
        pulls = self.pull(offsets.T, (velocities[q] - velocities[p]).T, self.pairs.values.T)
        count = len(positions)
        return np.column_stack([np.bincount(p, pulls * along, count) for along in offsets.T])

    @property
    def arrays(self) -> Mapping[str, int]:
        return {"pairs": self.pairs.bytes}

    @property
    def pair_count(self) -> int:
        return len(self.pairs.columns)

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        method = SumMethod.PAIR_LOOPS if compiled else SumMethod.PAIR_ARRAYS
        n, kept = len(self.pairs.starts) - 1, self.pairs.bytes
        return (Operations(method, self.pair_count, n, kept + 3 * 8 * n * dimension, kept),)

    def part(self, subset: Subset) -> Load:
        return _PartOfPairs(self.label, self.pairs.part(subset), self.pull)


class BodySums(Protocol):
    """The sums of which the internal forces of one body consist."""

    @property
    def body(self) -> Body:
        """The body."""

    @property
    def pair_count(self) -> int:
        """Ordered pairs that a gradient visits."""

    def gradient(self, field: Array) -> Array:
        """Gradient (d, d, n) of a vector field (n, d) of the body's particles."""

    def forces(self, stress: Array) -> Array:
        """Forces (n, d) [N] of a first Piola-Kirchhoff stress (d, d, n) [Pa]; ghosts have none."""


class RateStressLoad(Load):
    """Forces of a stress that depends on the deformation and its rate."""

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def reference(self) -> Array:
        """Reference positions X, (n, d) [m]."""

    @property
    @abstractmethod
    def sums(self) -> Sequence[BodySums]:
        """Gradient and divergence of every body, in order."""

    @abstractmethod
    def params_of(self, body: Body) -> tuple[float, ...]:
        """Numbers of a body that the formula uses, the same count for every body."""

    @staticmethod
    @abstractmethod
    def stress(F: Tensor, rate: Tensor, params: tuple[float, ...]) -> Tensor:
        """First Piola-Kirchhoff stress [Pa], pointwise, from F and dF/dt [1/s]."""

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.reference))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        u, forces = positions - self.reference, np.zeros_like(positions)
        for sums in self.sums:
            extent = sums.body.extent
            H, rate = sums.gradient(u[extent]), sums.gradient(velocities[extent])
            P = self.stress(add(H, identity(H)), rate, self.params_of(sums.body))
            forces[extent] = sums.forces(np.array(P))
        return forces

    @property
    def pair_count(self) -> int:
        return 3 * sum(sums.pair_count for sums in self.sums)  # both gradients, the divergence

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        method = SumMethod.STENCILS if compiled else SumMethod.PRODUCTS
        n, kept = len(self.reference), sum(self.arrays.values())
        # One pass of these counts as gathering and scattering.
        return (Operations(method, self.pair_count // 2, n, kept, kept),)


class HourglassLoad(Load):
    """Forces of the hourglass energy (`interfaces.hourglass_energy`), body by body."""

    is_counted: ClassVar[bool] = True
    acts_always: ClassVar[bool] = True
    supports: ClassVar[float] = 4.0  # the gradients of the partners of neighbours

    @property
    @abstractmethod
    def reference(self) -> Array:
        """Reference positions X, (n, d) [m]."""

    @property
    @abstractmethod
    def operators(self) -> Sequence[HourglassOperator]:
        """One operator per body."""

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.reference))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        u = positions - self.reference
        forces = np.zeros_like(u)
        for operator in self.operators:
            extent = operator.pairs.body.extent
            forces[extent] = operator.forces(u[extent])
        return forces

    @property
    def arrays(self) -> Mapping[str, int]:
        return {f"penalty of {o.pairs.body.name}": o.bytes for o in self.operators}

    @property
    def stiffness_rate(self) -> float:
        return max(operator.highest_frequency for operator in self.operators)

    @property
    def pair_count(self) -> int:
        return sum(o.operations(compiled=False).pairs for o in self.operators)

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        return tuple(o.operations(compiled=compiled) for o in self.operators)

    def part(self, subset: Subset) -> Load:
        operators = [operator.part(subset.particles) for operator in self.operators]
        return _PartOfHourglass(self.label, self.reference[subset.particles], operators)

    @cached_property
    def matrix(self) -> csr_array:
        """Stiffness K (n, n) [N/m]: the force is -K u in every component. Large in 3D."""
        blocks = [HourglassProducts.of(operator.pairs).matrix() for operator in self.operators]
        return csr_array(block_diag(blocks, format="csr"))

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """Minus the derivative of the forces, (d n, d n) [N/m], ordered by particle."""
        return csr_array(kron(self.matrix, np.eye(displacements.shape[1]), format="csr"))


# What acts on a subset of the particles; the whole term reports for it.


@final
@attrs.frozen(eq=False)
class _PartOfConstraint(ScheduledConstraint):
    label: str
    whole: ScheduledConstraint
    kept: Indices  # among its entries
    entries: tuple[Indices, Indices]
    shape: tuple[int, ...]

    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        return self.whole.schedule(times, derivative, step)[:, self.kept]


@final
@attrs.frozen(eq=False)
class _PartOfScheduled(ScheduledLoad):
    label: str
    whole: ScheduledLoad
    kept: Indices  # among its particles
    particles: Indices

    def schedule(self, times: Array) -> Array:
        return self.whole.schedule(times)[:, self.kept]


@final
@attrs.frozen(eq=False)
class _PartOfPointwise(PointwiseLoad):
    label: str
    particles: Indices
    values: Array
    force: Callable[..., Any]


@final
@attrs.frozen(eq=False)
class _PartOfPairs(PairLoad):
    label: str
    pairs: PairTable
    pull: Callable[..., Any]


@final
@attrs.frozen(eq=False)
class _PartOfHourglass(HourglassLoad):
    label: str
    reference: Array
    operators: Sequence[HourglassOperator]
