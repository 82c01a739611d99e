"""A displacement imposed as a function of position and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Term
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import Where
from solidsph.registry.parameters import formula
from solidsph_builtin.boundaries._imposed import imposed_motion


@final
@attrs.frozen
class PrescribedMotion(BoundaryHandler):
    """u = displacement(X, t) on the chosen particles; components not given stay free.

    Velocity and acceleration of the imposed motion are its time derivatives, so the reaction
    reported includes the inertia of the particles moved.
    """

    where: Where
    displacement: Mapping[str, Component] = formula()  # such as {x = "0.1*t", y = 0} [m]

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        field = VectorField.of(self.displacement, "prescribed-motion: displacement", end=model.end)
        field.check_dimension(model.particles.dimension, "prescribed-motion")
        indices = model.select(self.where)
        for axis in field.components:  # a formula out of its domain shows now, not in mid-run
            field.values(axis, model.particles.positions[indices], 0.0)
        return [imposed_motion(model, label, indices, field, self.where)]
