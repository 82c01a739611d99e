"""A motion imposed on selected particles, component by component."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.compilable_terms import ScheduledConstraint
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import VectorField
from solidsph.model.particles import Face
from solidsph.model.regions import Where
from solidsph_builtin.boundaries._reports import reaction, stress_reaction


@final
@attrs.frozen(eq=False)
class ImposedMotion(ScheduledConstraint):
    """u = field(X, t) on some particles, in the components that the field has."""

    label: str
    indices: Indices  # (k,)
    positions: Array  # (n, d) reference positions of all particles
    field: VectorField
    stressed_face: Face | None  # their face, if the reaction is that of the stress

    @property
    def shape(self) -> tuple[int, ...]:
        return self.positions.shape

    @cached_property
    def entries(self) -> tuple[Indices, Indices]:
        axes = np.array(list(self.field.components), dtype=np.intp)
        return np.tile(self.indices, len(axes)), np.repeat(axes, len(self.indices))

    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        if self._lasting is None:
            return self._schedule(times, derivative, step)
        return self._lasting if derivative == 0 else np.zeros_like(self._lasting)

    @cached_property
    def _lasting(self) -> Array | None:
        """The displacements (1, m) [m], if they do not change in time: those of a clamp."""
        if any(map(self.field.varies, self.field.components)):
            return None
        return self._schedule(np.zeros(1), 0, 0.0)

    def _schedule(self, times: Array, derivative: int, step: float) -> Array:
        X = self.positions[self.indices]
        columns = [
            self.field.derivative_schedule(axis, X, times, derivative, step)
            for axis in self.field.components
        ]
        rows = max(map(len, columns))
        return np.hstack([np.broadcast_to(column, (rows, len(X))) for column in columns])

    def report(self, observation: Observation) -> Mapping[str, float]:
        if self.stressed_face is not None:
            return stress_reaction(observation, self.label, self.stressed_face)
        return reaction(observation, self.label)


def imposed_motion(
    model: DiscreteModel,
    label: str,
    indices: Indices,
    field: VectorField,
    where: Where | None = None,
) -> ImposedMotion:
    """Impose `field` on the particles `indices` of a model, those at `where` if given."""
    particles = model.particles
    by_stress = any(
        body.formulation.divergence.uses_ghost_stress and body.particles.ghosts.any()
        for body in model.bodies
    )
    return ImposedMotion(
        label=label,
        indices=indices,
        positions=particles.positions,
        field=field,
        stressed_face=_surface(model, indices, where) if by_stress else None,
    )


def _surface(model: DiscreteModel, indices: Indices, where: Where | None) -> Face:
    """The surface at `where`, or all of it that the particles `indices` own."""
    if where is None:
        return Face(indices, model.particles.area_vectors[indices])
    pieces = model.pieces()
    return pieces.owned(pieces.at(where))
