"""An engine that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import attrs

from solidsph.engines.matrix import MatrixEngine, MatrixForces
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.plan import BodySize, Operations, Plan, SumMethod
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Wrapped(InternalForces):
    sums: MatrixForces

    @property
    def pair_count(self) -> int:
        return self.sums.pair_count

    def forces(self, time: float, displacements: Array) -> Array:
        return self.sums.forces(time, displacements)

    def fields(self, displacements: Array) -> StressFields:
        return self.sums.fields(displacements)

    def gradients(self, displacements: Array) -> Array:
        return self.sums.gradients(displacements)

    def spread(self, displacements: Array, stress: Array) -> Array:
        return self.sums.spread(displacements, stress)


class WeakForces(Wrapped):
    def forces(self, time: float, displacements: Array) -> Array:
        return (1.0 - 1e-9) * super().forces(time, displacements)


class HalfTheEnergy(Wrapped):
    def fields(self, displacements: Array) -> StressFields:
        found = super().fields(displacements)
        return attrs.evolve(found, energy_densities=0.5 * found.energy_densities)


class TransposedGradients(Wrapped):
    def gradients(self, displacements: Array) -> Array:
        return super().gradients(displacements).transpose(0, 2, 1)


class SpreadBackwards(Wrapped):
    def spread(self, displacements: Array, stress: Array) -> Array:
        return -super().spread(displacements, stress)


@attrs.frozen
class GoodEngine(Engine):
    """The reference under another name."""

    kind: ClassVar[Any] = Wrapped

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        return self.kind(MatrixEngine().prepare(bodies, conditions, evaluations))


class Weakens(GoodEngine):
    kind: ClassVar[Any] = WeakForces


class LosesEnergy(GoodEngine):
    kind: ClassVar[Any] = HalfTheEnergy


class Transposes(GoodEngine):
    kind: ClassVar[Any] = TransposedGradients


class Reverses(GoodEngine):
    kind: ClassVar[Any] = SpreadBackwards


class DeafToStressTerms(GoodEngine):
    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        return super().prepare(bodies, (), evaluations)


class PlansLessThanNothing(GoodEngine):
    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        return Plan(False, (Operations(SumMethod.UNKNOWN, -1, 0, 0, 0),))


ENGINES = [
    (Weakens, {"forces"}),
    (LosesEnergy, {"fields"}),
    (Transposes, {"passes"}),
    (Reverses, {"passes"}),
    (DeafToStressTerms, {"stress terms"}),
    (PlansLessThanNothing, {"plan"}),
]
