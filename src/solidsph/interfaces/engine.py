"""Engine: evaluates the sums over neighbours. Nothing else loops over pairs."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import attrs

from solidsph.interfaces.body import Body
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.part import Part
from solidsph.interfaces.plan import (
    BodySize,
    Compilation,
    CompilationUnit,
    Operations,
    Plan,
    SumMethod,
)
from solidsph.interfaces.row_weights import RowWeights
from solidsph.interfaces.terms import StressTerm
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array, Indices


@attrs.frozen(eq=False)
class StressFields:
    """Deformation, stress and energy of every particle; ghosts have F = I and no stress."""

    deformation_gradients: Array  # (n, d, d) F [-]
    stresses: Array  # (n, d, d) first Piola-Kirchhoff stress P [Pa]
    energy_densities: Array  # (n,) psi [J/m^3]
    dissipated_densities: Array | None = None  # (n,) [J/m^3], where a material dissipates


class InternalForces(ABC):
    """Forces inside the bodies as a function of the displacements of their particles."""

    advances_histories: ClassVar[bool] = False
    """True if it advances the internal variables of materials itself."""

    @property
    @abstractmethod
    def pair_count(self) -> int:
        """Ordered pairs that one evaluation sums over, self pairs included."""

    @abstractmethod
    def forces(self, time: float, displacements: Array) -> Array:
        """Force on every particle, (n, d) [N], from displacements u = x - X (n, d) [m]."""

    @abstractmethod
    def fields(self, displacements: Array) -> StressFields:
        """Deformation, stress and energy at displacements (n, d) [m], for reports and records."""

    @abstractmethod
    def gradients(self, displacements: Array) -> Array:
        """Displacement gradients H = Grad u, (n, d, d), of displacements (n, d) [m].

        This and `spread` are the two passes of `forces`, for a law that comes between them.
        """

    @abstractmethod
    def spread(self, displacements: Array, stress: Array) -> Array:
        """Forces (n, d) [N] of a stress (d, d, n) [Pa] at these displacements.

        `stress` is the formulation's flux; it may be overwritten.
        """

    def own_stiffness(self, moduli: Array) -> Array | None:
        """Force on every particle against its own displacement alone, (n, d, d) [N/m].

        None, the default, if the engine cannot tell.

        Args:
            moduli: dT_ik / dF_jl of all particles, (n, d d, d d) [Pa].
        """
        return None

    def law(self, body: Body) -> Law | None:
        """The engine's own form of a body's law, to be used between the two passes.

        None, the default, to evaluate the law by arrays.
        """
        return None

    def part(self, chosen: Indices) -> InternalForces | None:
        """Forces on a subset of the particles, renumbered in order.

        Exact where all neighbours and their neighbours are in the subset. None, the default, if
        the forces cannot be formed on a subset.

        Args:
            chosen: particles in ascending order, (k,).
        """
        return None

    def reweighted(self, changed: Sequence[RowWeights]) -> InternalForces | None:
        """These forces with other weights of the gradient, and the divergence adjoint to it.

        None, the default, if the engine cannot change its sums.

        Args:
            changed: rows that take the place of the engine's own, for every body.
        """
        return None

    def advance(
        self, time: float, step: float, displacements: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        """Forces (n, d) [N] at the end of a step, and what the bodies remember of it.

        Args:
            time: end of the step [s].
            step: length of the step [s]; 0 if no step is made.
            displacements: at its end, (n, d) [m].
            memory: `State.memory` at its beginning.
        """
        return self.forces(time, displacements), {}

    def observed(self, displacements: Array, memory: Memory) -> StressFields:
        """The fields of a state with this memory."""
        return self.fields(displacements)

    @property
    def operations(self) -> Sequence[Operations]:
        """Operations of one evaluation; by default those of an engine that stores pair indices."""
        own = 8 * self.pair_count
        return (Operations(SumMethod.UNKNOWN, self.pair_count, 0, own, own),)

    @property
    def compilations(self) -> frozenset[Compilation]:
        """What must be compiled for one evaluation."""
        return frozenset()

    def note(self, compilations: frozenset[Compilation]) -> None:
        """Take note that a run has compiled these, which `Compilation.on_disk` then tells.

        Does nothing by default.
        """
        return

    @property
    def precision(self) -> float:
        """Machine epsilon of the numbers that are summed."""
        return sys.float_info.epsilon

    @property
    def bytes(self) -> int:
        """Memory of the arrays kept between evaluations [bytes]."""
        return sum(part.held for part in self.operations)

    def plan(self, equation: EquationOfMotion, integrator: Integrator) -> Plan:
        """How a run would be carried out, as far as the types of the parts determine it.

        Nothing is compiled to answer. Costs, `explain` and the time loop all ask here.
        """
        d = equation.particles.dimension
        operations = [o for load in equation.loads for o in load.operations(d, compiled=False)]
        threaded = any(o.threaded for o in (*self.operations, *operations))
        sweeps = {
            Compilation(CompilationUnit.SWEEPS, d, threaded)
            for o in operations
            if o.method is SumMethod.HOURGLASS_SWEEPS
        }
        return Plan(False, self.operations, operations, self.compilations | sweeps)

    def time_loop(self, equation: EquationOfMotion, integrator: Integrator) -> TimeLoop | None:
        """The engine's own time loop under these forces; None, the default, to step by step.

        It advances the internal variables of materials that have some.
        """
        return None


class Engine(Part):
    """Prepares bodies for fast evaluation of their internal forces."""

    @abstractmethod
    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        """The internal forces of `bodies`, which together hold all particles, in order.

        Args:
            bodies: the bodies.
            conditions: terms that change the stress before forces are formed.
            evaluations: expected number of evaluations, which preparation should pay off within.

        Raises:
            BuildError: a formulation's operators cannot be formed on these particles.
        """

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        """The plan for bodies that are not built yet, without loads.

        Args:
            sizes: size of every body.
            evaluations: expected number of evaluations.
        """
        pairs = round(sum(size.pairs for size in sizes))
        return Plan(False, (Operations(SumMethod.UNKNOWN, pairs, 0, 8 * pairs, 8 * pairs),))
