"""Damping in proportion to mass and velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import PointwiseLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.terms import Load, Observation
from solidsph.maths.arrays import Array, Indices, Vector
from solidsph.maths.tensors import scaled
from solidsph.model.regions import Where
from solidsph.registry.parameters import check_positive, number


@final
@attrs.frozen
class MassDamping(Effect):
    """f = -c m v: every free vibration decays as exp(-c t / 2). Rayleigh's first term."""

    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.REST})

    rate: float = number()  # c [1/s]
    where: Where = "all"

    example: ClassVar[Mapping[str, Any]] = {"rate": 20.0}

    def __attrs_post_init__(self) -> None:
        check_positive("mass-damping", "rate", self.rate, "1/s, or leave the effect out")

    def bind(self, model: DiscreteModel, label: str) -> Load:
        indices = model.select(self.where)
        return _Drag(label, indices, self.rate * model.masses[indices, None])

    def arrays(self, model: DiscreteModel) -> Mapping[str, int]:
        count = len(model.select(self.where))
        return {"chosen particles": 8 * count, "drag": 8 * count}

    def damping_rate(self, bodies: Sequence[Body]) -> float:
        return self.rate

    def stiffness_rate(self, bodies: Sequence[Body]) -> float:
        return 0.0


@final
@attrs.frozen(eq=False)
class _Drag(PointwiseLoad):
    label: str
    particles: Indices  # (k,)
    values: Array  # c m, (k, 1) [kg/s]

    @staticmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        return scaled(-values[0], velocity)

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
