"""Engine: how the sums over neighbours are carried out. Nothing else loops over pairs."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law
from solidsph.interfaces.plan import (
    BodySize,
    Compilation,
    CompilationUnit,
    Operations,
    Plan,
    SumMethod,
)
from solidsph.interfaces.terms import StressTerm
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array, Indices


@attrs.frozen(eq=False)
class StressFields:
    """What the material says at every particle; ghosts show F = I and no stress of their own."""

    deformation_gradients: Array  # (n, d, d) F [-]
    stresses: Array  # (n, d, d) first Piola-Kirchhoff stress P [Pa]
    energy_densities: Array  # (n,) psi [J/m^3]
    dissipated_densities: Array | None = None  # (n,) [J/m^3], where a material dissipates


class InternalForces(ABC):
    """The forces that bodies exert on themselves, as a function of where their particles are."""

    advances_histories: ClassVar[bool] = False
    """Whether it asks materials that remember itself."""

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

    @abstractmethod
    def gradients(self, displacements: Array) -> Array:
        """H = Grad u of displacements, or of any vector field (n, d), (n, d, d).

        This and `spread` are the two passes of `forces`, for a law that comes between them.
        """

    @abstractmethod
    def spread(self, displacements: Array, stress: Array) -> Array:
        """Forces (n, d) [N] of a stress (d, d, n) [Pa] at these displacements.

        `stress` is the formulation's flux; it may be written on.
        """

    def law(self, body: Body) -> Law | None:
        """How the material of a body is asked for its stress between the two passes; None: by
        arrays."""
        return None

    def check_parts(self) -> None:
        """Raise SceneError unless the forces of some particles can be formed alone, by `part`."""
        raise SceneError(
            f"sleep: {type(self).__name__} cannot form the forces of some particles alone; use one "
            "body of the total Lagrangian form whose material remembers nothing, without ghosts, "
            "or leave [sleep] out"
        )

    def part(self, chosen: Indices) -> InternalForces:
        """The same forces of the chosen particles alone, which are numbered in their order.

        Right for those of them whose neighbours, and the neighbours of those, are all chosen.

        Args:
            chosen: particles in rising order, (k,).
        """
        raise AssertionError("`check_parts` has refused it")

    def advance(
        self, time: float, step: float, displacements: Array, memory: Mapping[str, Array]
    ) -> tuple[Array, Mapping[str, Array]]:
        """The forces at the end of a step, and what the bodies remember of it.

        Args:
            time: at its end [s].
            step: its length [s]; 0 if none is made.
            displacements: at its end, (n, d) [m].
            memory: `State.memory` at its beginning.
        """
        return self.forces(time, displacements), {}

    def observed(self, displacements: Array, memory: Mapping[str, Array]) -> StressFields:
        """The fields of a state that has this memory."""
        return self.fields(displacements)

    @property
    def operations(self) -> Sequence[Operations]:
        """What one evaluation passes over.

        An engine that does not say is taken for one that keeps nothing but its pairs' indices.
        """
        own = 8 * self.pair_count
        return (Operations(SumMethod.UNKNOWN, self.pair_count, 0, own, own),)

    @property
    def compilations(self) -> frozenset[Compilation]:
        """What has to be compiled for one evaluation."""
        return frozenset()

    @property
    def precision(self) -> float:
        """Of the numbers that forces are sums of: the least that makes a difference beside 1."""
        return sys.float_info.epsilon

    @property
    def bytes(self) -> int:
        """Memory of the arrays kept between evaluations."""
        return sum(part.held for part in self.operations)

    def plan(self, equation: EquationOfMotion, integrator: Integrator) -> Plan:
        """How a run would be carried out, as far as the kinds of the parts tell.

        Nothing is compiled to say so; costs, `explain` and the time loop all ask here.
        """
        d = equation.particles.dimension
        operations = [o for load in equation.loads for o in load.operations(d, compiled=False)]
        sweeps = {
            Compilation(
                CompilationUnit.SWEEPS, d, any(o.threaded for o in (*self.operations, *operations))
            )
            for o in operations
            if o.method is SumMethod.HOURGLASS_SWEEPS
        }
        return Plan(False, self.operations, operations, self.compilations | sweeps)

    def time_loop(self, equation: EquationOfMotion, integrator: Integrator) -> TimeLoop | None:
        """The engine's own loop over steps under these forces, or None."""
        return None


class Engine(ABC):
    """Prepares bodies for fast evaluation; owns whatever arrays that takes."""

    @abstractmethod
    def prepare(
        self,
        bodies: Sequence[Body],
        conditions: Sequence[StressTerm],
        evaluations: int = 1,
    ) -> InternalForces:
        """The internal forces of `bodies`, which together hold all particles, in order.

        Args:
            bodies: what exerts the forces.
            conditions: what changes the stress before they are formed.
            evaluations: about how often the forces will be asked for, which preparation should
                be in proportion to.

        Raises:
            BuildError: a formulation's operators cannot be formed on these particles.
        """

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        """The plan for bodies that are not built, from their sizes; loads are left out.

        Args:
            sizes: of every body.
            evaluations: about how often the forces will be asked for.
        """
        pairs = round(sum(size.pairs for size in sizes))
        return Plan(False, (Operations(SumMethod.UNKNOWN, pairs, 0, 8 * pairs, 8 * pairs),))
