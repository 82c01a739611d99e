"""Dynamics: the equation of motion of a whole scene, assembled from its parts.

It knows no part by name: internal forces come from an engine, and what is imposed comes from
conditions, each called only for what its type can do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.equation_of_motion import EquationOfMotion, Response
from solidsph.interfaces.memory import NOTHING
from solidsph.interfaces.terms import (
    GhostConstraint,
    Observation,
)
from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import Particles, State, shut


@final
@attrs.frozen(eq=False)
class Dynamics(EquationOfMotion):
    """Right-hand side of the equation of motion."""

    internal: InternalForces
    held: Sequence[Mask] = attrs.field(init=False)  # freedoms (n, d) that each motion determines

    # What observers see of these, and cannot write to.
    shown: Particles = attrs.field(init=False, repr=False)
    shown_masses: Array = attrs.field(init=False, repr=False)

    @shown.default
    def _particles_to_look_at(self) -> Particles:
        return self.particles.read_only()

    @shown_masses.default
    def _masses_to_look_at(self) -> Array:
        return shut(self.masses)

    @held.default
    def _held_by_each(self) -> Sequence[Mask]:
        return [motion.held for motion in self.constraints]

    def place(self, time: float, positions: Array) -> Array:
        """Positions (n, d) with every imposed motion applied at `time` [s]."""
        if not self.constraints:
            return positions
        displacements = positions - self.particles.positions
        for motion in self.constraints:
            motion.impose(time, 0, displacements, self.step_size)
        return self.particles.positions + displacements

    def carry(self, time: float, velocities: Array) -> Array:
        """Velocities (n, d) with every imposed motion applied at `time` [s]."""
        if not self.constraints:
            return velocities
        carried = velocities.copy()
        for motion in self.constraints:
            motion.impose(time, 1, carried, self.step_size)
        return carried

    def respond(
        self,
        time: float,
        positions: Array,
        velocities: Array,
        step: float = 0.0,
        memory: Mapping[str, Array] = NOTHING,
    ) -> Response:
        """Accelerations, and the force that each imposed part exerts on every particle.

        Free degrees of freedom follow f = m a. Held ones follow the imposed motion, and what is
        missing of m a is the reaction; ghosts have no mass, so theirs balances the force on them.
        """
        displacements = positions - self.particles.positions
        internal, kept = self.internal.advance(time, step, displacements, memory)
        remembered = dict(kept)
        applied = {c.label: np.zeros_like(positions) for c in (*self.loads, *self.constraints)}
        total = internal.copy()
        for load in self.loads:
            force, kept = load.advance(time, step, positions, velocities, memory)
            remembered |= kept
            applied[load.label][load.particles] += force
            total[load.particles] += force
        for motion in self.constraints:
            if isinstance(motion, GhostConstraint):
                before = total.copy()
                motion.return_forces(total)
                applied[motion.label] += total - before
        real = ~self.particles.ghosts
        accelerations = np.zeros_like(positions)
        accelerations[real] = total[real] / self.masses[real, None]
        for motion in self.constraints:
            motion.impose(time, 2, accelerations, self.step_size)
        if self.constraints:
            missing = self.masses[:, None] * accelerations - total
        for motion, held in zip(self.constraints, self.held, strict=True):
            applied[motion.label] += np.where(held, missing, 0.0)
        return Response(accelerations, applied, remembered)

    def observe(self, state: State) -> Observation:
        """The state with its deformation, stress and energy."""
        displacements = state.positions - self.particles.positions
        fields = self.internal.observed(displacements, state.memory)
        return Observation(
            state=state,
            particles=self.shown,
            masses=self.shown_masses,
            deformation_gradients=fields.deformation_gradients,
            stresses=fields.stresses,
            energy_densities=fields.energy_densities,
            dissipated_densities=fields.dissipated_densities,
        )
