"""Conditions that declare what they depend on, so that an engine can carry them out by itself.

A condition may be any code that the time loop calls. One of these kinds is described by arrays and
a pointwise formula instead; from that description follow both what the interface asks of it, here,
and what an engine compiles into its own loop.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_array, kron

from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassProducts
from solidsph.interfaces.plan import Operations, SumMethod, array_bytes
from solidsph.interfaces.subset import Subset
from solidsph.interfaces.terms import (
    Constraint,
    GhostConstraint,
    Load,
    Observation,
    StressTerm,
    Term,
)
from solidsph.maths.arrays import Array, Indices, Mask, Scalar, Vector


class ScheduledConstraint(Constraint):
    """Determines motion as a function of time alone."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """(n, d) of all particles."""

    @property
    @abstractmethod
    def entries(self) -> tuple[Indices, Indices]:
        """Particle (m,) and axis (m,) of every degree of freedom that it determines."""

    @abstractmethod
    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        """Values of these entries at `times` (t,) [s], (t, m); (1, m) if they are always the same.

        Displacements for derivative 0, velocities for 1, accelerations for 2, which may be
        differences over the time `step` [s] of the run.
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
        return _PartOfConstraint(self, kept, entries, (len(subset.particles), self.shape[1]))


class LinearExtension(GhostConstraint, StressTerm):
    """Ghosts whose values are linear combinations of others', each component by itself.

    u_i = s_i A u_i and T_ik = s_i s_k B T_ik, with signs s that turn components over.
    """

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """(n, d) of all particles."""

    @property
    @abstractmethod
    def ghosts(self) -> Indices:
        """Those that follow, (k,)."""

    @property
    @abstractmethod
    def displacement(self) -> csr_array:
        """A, (k, n)."""

    @property
    @abstractmethod
    def stress(self) -> csr_array:
        """B, (k, n)."""

    @property
    @abstractmethod
    def signs(self) -> Array:
        """s, (k, d)."""

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
        """Forces on its particles at `times` (t,) [s], (t, k, d) [N]; (1, k, d) if they are always
        the same."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        forces: Array = self.schedule(np.array([time]))[0]
        return forces

    def part(self, subset: Subset) -> Load:
        return _PartOfScheduled(self, *subset.kept(self.particles))


class PointwiseLoad(Load):
    """The force on a particle by its own position and velocity."""

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def values(self) -> Array:
        """(k, m) m numbers for each of its particles, which the formula is handed."""

    @staticmethod
    @abstractmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        """Force [N], a tuple of components; each argument is indexed by component."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        x, v = positions[self.particles], velocities[self.particles]
        found = self.force(x.T, v.T, self.values.T)
        return np.column_stack([np.broadcast_to(one, len(x)) for one in found])

    def part(self, subset: Subset) -> Load:
        kept, own = subset.kept(self.particles)
        return _PartOfPointwise(self.label, own, self.values[kept], self.force)


@attrs.frozen(eq=False)
class PairTable:
    """Pairs of particles, each both ways, and numbers that belong to them."""

    starts: Indices  # (n + 1,) those of particle p stand at starts[p] : starts[p + 1]
    columns: NDArray[np.int32]  # (m,) q
    values: Array  # (m, k) the same for (p, q) and (q, p)

    @property
    def rows(self) -> Indices:
        """(m,) p."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    @property
    def bytes(self) -> int:
        """Memory of its arrays."""
        return array_bytes([self.starts, self.columns, self.values])

    def part(self, subset: Subset) -> PairTable:
        """The pairs both ends of which are in a subset."""
        sizes = np.diff(self.starts)[subset.particles]
        ends = np.cumsum(sizes)
        taken = np.repeat(self.starts[subset.particles] - (ends - sizes), sizes)
        taken = taken + np.arange(sizes.sum())
        columns = subset.places[self.columns[taken]]
        inside = columns >= 0
        rows = np.repeat(np.arange(len(subset.particles)), sizes)[inside]
        counts = np.bincount(rows, minlength=len(subset.particles))
        return PairTable(
            starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
            columns=columns[inside].astype(np.int32),
            values=self.values[taken[inside]],
        )


class PairLoad(Load):
    """Forces along the line between two particles, opposite at its ends.

    They keep momentum and angular momentum to rounding whatever the formula is.
    """

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def pairs(self) -> PairTable:
        """Which pairs, of all n particles."""

    @staticmethod
    @abstractmethod
    def pull(offset: Vector, velocity: Vector, values: Vector) -> Scalar:
        """Force on p over the offset x_q - x_p that it is along [N/m]; pointwise.

        Args:
            offset: x_q - x_p [m].
            velocity: v_q - v_p [m/s].
            values: the pair's numbers.
        """

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.pairs.starts) - 1)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        p, q = self.pairs.rows, self.pairs.columns
        offsets = positions[q] - positions[p]
        pulls = self.pull(offsets.T, (velocities[q] - velocities[p]).T, self.pairs.values.T)
        count = len(positions)
        along = (np.bincount(p, pulls * one, count) for one in offsets.T)
        return np.column_stack(list(along))

    @property
    def arrays(self) -> Mapping[str, int]:
        return {"pairs": self.pairs.bytes}

    @property
    def pair_count(self) -> int:
        return len(self.pairs.columns)

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        way = SumMethod.PAIR_LOOPS if compiled else SumMethod.PAIR_ARRAYS
        n, kept = len(self.pairs.starts) - 1, self.pairs.bytes
        return (Operations(way, self.pair_count, n, kept + 3 * 8 * n * dimension, kept),)

    def part(self, subset: Subset) -> Load:
        return _PartOfPairs(self.label, self.pairs.part(subset), self.pull)


class HourglassLoad(Load):
    """Forces of the hourglass energy (`interfaces.hourglass_energy`), body by body."""

    is_counted: ClassVar[bool] = True
    supports: ClassVar[float] = 4.0  # the gradients of partners of neighbours

    @property
    @abstractmethod
    def reference(self) -> Array:
        """X, (n, d) [m]."""

    @property
    @abstractmethod
    def operators(self) -> Sequence[HourglassOperator]:
        """One for every body."""

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
        return {f"penalty of {one.pairs.body.name}": one.bytes for one in self.operators}

    @property
    def stiffness_rate(self) -> float:
        return max(one.highest_frequency for one in self.operators)

    @property
    def pair_count(self) -> int:
        return sum(one.operations(compiled=False).pairs for one in self.operators)

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        return tuple(one.operations(compiled=compiled) for one in self.operators)

    def part(self, subset: Subset) -> Load:
        operators = [one.part(subset.particles) for one in self.operators]
        return _PartOfHourglass(self.label, self.reference[subset.particles], operators)

    @cached_property
    def matrix(self) -> csr_array:
        """K (n, n) [N/m]: the force is -K u in every component; large in 3D."""
        blocks = [HourglassProducts.of(one.pairs).matrix() for one in self.operators]
        return csr_array(block_diag(blocks, format="csr"))

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """Minus the derivative of the force, (d n, d n), particle by particle."""
        return csr_array(kron(self.matrix, np.eye(displacements.shape[1]), format="csr"))


class _Part(Term):
    """Of a load or constraint, what acts on a subset of the particles; reports are of the whole."""

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _PartOfConstraint(_Part, ScheduledConstraint):
    whole: ScheduledConstraint
    kept: Indices  # among its entries
    entries: tuple[Indices, Indices]
    shape: tuple[int, ...]

    @property
    def label(self) -> str:
        return self.whole.label

    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        return self.whole.schedule(times, derivative, step)[:, self.kept]


@final
@attrs.frozen(eq=False)
class _PartOfScheduled(_Part, ScheduledLoad):
    whole: ScheduledLoad
    kept: Indices  # among its particles
    particles: Indices

    @property
    def label(self) -> str:
        return self.whole.label

    def schedule(self, times: Array) -> Array:
        return self.whole.schedule(times)[:, self.kept]


@final
@attrs.frozen(eq=False)
class _PartOfPointwise(_Part, PointwiseLoad):
    label: str
    particles: Indices
    values: Array
    force: Callable[..., Any]


@final
@attrs.frozen(eq=False)
class _PartOfPairs(_Part, PairLoad):
    label: str
    pairs: PairTable
    pull: Callable[..., Any]


@final
@attrs.frozen(eq=False)
class _PartOfHourglass(_Part, HourglassLoad):
    label: str
    reference: Array
    operators: Sequence[HourglassOperator]
