"""Damping in proportion to mass and velocity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.compilable_terms import PointwiseLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.terms import Load
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
        return _Drag(label, indices, self.rate * model.masses[indices, None], self.rate)


@final
@attrs.frozen(eq=False)
class _Drag(PointwiseLoad):
    label: str
    particles: Indices  # (k,)
    values: Array  # c m, (k, 1) [kg/s]
    damping_rate: float  # c [1/s]

    @staticmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        return scaled(-values[0], velocity)
