"""A displacement imposed as a function of position and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, field_arrows, marks_of
from solidsph.interfaces.terms import Term
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._imposed import ImposedMotion, imposed_motion


@final
@attrs.frozen
class PrescribedMotion(BoundaryHandler):
    """u = displacement(X, t) on the particles at `where`; components not given are free.

    Velocity and acceleration of the imposed motion are its time derivatives, so the reported
    reaction includes the inertia of these particles.
    """

    where: Where
    displacement: Mapping[str, Component] = formula()  # such as {x = "0.1*t", y = 0} [m]

    example: ClassVar[Mapping[str, Any]] = {
        "where": "left",
        "displacement": {"x": "0.002*sin(300*t)"},
    }

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        field = VectorField.of(self.displacement, "prescribed-motion: displacement", end=model.end)
        field.check_dimension(model.particles.dimension, "prescribed-motion")
        indices = model.select(self.where)
        for axis in field.components:  # refuses a formula out of its domain now, not in the run
            field.values(axis, model.particles.positions[indices], 0.0)
        return [imposed_motion(model, label, indices, field, self.where)]

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        (imposed,) = self.bind(model, label)
        assert isinstance(imposed, ImposedMotion)
        X = model.particles.positions[imposed.indices]
        return (
            *marks_of([imposed], model.particles, model.end),
            field_arrows(imposed.field, X, "displacement", "m"),
        )
