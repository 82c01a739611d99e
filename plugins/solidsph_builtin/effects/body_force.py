"""A body force, such as gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.compilable_terms import ScheduledLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.marks import Mark, field_arrows
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import Component, VectorField, scheduled_forces
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula


@final
@attrs.frozen
class BodyForce(Effect):
    """f = m b(X, t): the body force of Ismail & Reddy, eq. 14, which they neglect."""

    answers: ClassVar[frozenset[Need] | None] = frozenset()

    acceleration: Mapping[str, Component] = formula()  # b such as {y = -9.81} [m/s^2]
    where: Where = "all"

    example: ClassVar[Mapping[str, Any]] = {"acceleration": {"x": "-9.81*cos(50*t)"}}

    def bind(self, model: DiscreteModel, label: str) -> Load:
        indices = model.select(self.where)
        return _MassTimesField(
            label=label,
            particles=indices,
            positions=model.particles.positions[indices],
            masses=model.masses[indices],
            field=self._field(model),
        )

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        X = model.particles.positions[model.select(self.where)]
        return (field_arrows(self._field(model), X, "body force", "m/s^2"),)

    def _field(self, model: DiscreteModel) -> VectorField:
        field = VectorField.of(self.acceleration, "body-force: acceleration", end=model.end)
        field.check_dimension(model.particles.dimension, "body-force")
        return field


@final
@attrs.frozen(eq=False)
class _MassTimesField(ScheduledLoad):
    label: str
    particles: Indices  # (k,)
    positions: Array  # (k, d) reference positions
    masses: Array  # (k,)
    field: VectorField

    @property
    def arrays(self) -> Mapping[str, int]:
        return {
            "chosen particles": self.particles.nbytes,
            "positions": self.positions.nbytes,
            "masses": self.masses.nbytes,
        }

    def schedule(self, times: Array) -> Array:
        return scheduled_forces(self.field, self.positions, self.masses, times)
