"""Dynamics: equation of motion of a scene.

Internal forces come from an engine; loads and constraints are terms, called by their type.
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
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles, State, locked


@final
@attrs.frozen(eq=False)
class Dynamics(EquationOfMotion):
    """Equation of motion of a scene."""

    internal: InternalForces
    held: Sequence[Mask] = attrs.field(init=False)  # (n, d) components that each motion determines

    every: Indices = attrs.field(init=False, repr=False)
    inverse_masses: Array = attrs.field(init=False, repr=False)  # (n, 1) [1/kg]; 0 for ghosts

    # Read-only views for observers.
    shown: Particles = attrs.field(init=False, repr=False)
    shown_masses: Array = attrs.field(init=False, repr=False)

    @shown.default
    def _read_only_particles(self) -> Particles:
        return self.particles.read_only()

    @shown_masses.default
    def _masses_to_look_at(self) -> Array:
        return locked(self.masses)

    @every.default
    def _every_particle(self) -> Indices:
        return np.arange(self.particles.count)

    @inverse_masses.default
    def _inverse_masses(self) -> Array:
        inverse = np.zeros_like(self.masses)  # ghosts have no mass, and no equation of motion
        np.divide(1.0, self.masses, out=inverse, where=self.masses > 0.0)
        return inverse[:, None]

    @held.default
    def _held_components(self) -> Sequence[Mask]:
        return [motion.held for motion in self.constraints]

    @property
    def free(self) -> Mask:
        """Components (n, d) of real particles that no constraint determines."""
        free = np.repeat(~self.particles.ghosts[:, None], self.particles.dimension, axis=1)
        for held in self.held:
            free &= ~held
        return free

    def place(self, time: float, positions: Array) -> Array:
        """Positions (n, d) with the imposed motions of `time` [s]."""
        if not self.constraints:
            return positions
        displacements = positions - self.particles.positions
        for motion in self.constraints:
            motion.impose(time, 0, displacements, self.step_size)
        return self.particles.positions + displacements

    def carry(self, time: float, velocities: Array) -> Array:
        """Velocities (n, d) with the imposed motions of `time` [s]."""
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
        """Accelerations, and the forces of all terms on every particle.

        Free degrees of freedom obey m a = f. Held ones follow the imposed motion, with the
        reaction m a - f. Ghosts have no mass, so their reaction balances the force on them.
        """
        displacements = positions - self.particles.positions
        internal, changed = self.internal.advance(time, step, displacements, memory)
        advanced = dict(changed)
        applied = {c.label: np.zeros_like(positions) for c in (*self.loads, *self.constraints)}
        total = internal.copy()
        for load in self.loads:
            force, changed = load.advance(time, step, positions, velocities, memory)
            advanced |= changed
            own = load.particles
            # A slice takes a tenth of the time of as many indices.
            places = slice(None) if np.array_equal(own, self.every) else own
            applied[load.label][places] += force
            total[places] += force
        for motion in self.constraints:
            if isinstance(motion, GhostConstraint):
                before = total.copy()
                motion.return_forces(total)
                applied[motion.label] += total - before
        accelerations = total * self.inverse_masses
        for motion in self.constraints:
            motion.impose(time, 2, accelerations, self.step_size)
        if self.constraints:
            reactions = self.masses[:, None] * accelerations - total
        for motion, held in zip(self.constraints, self.held, strict=True):
            applied[motion.label] += np.where(held, reactions, 0.0)
        return Response(accelerations, applied, advanced)

    def observe(self, state: State) -> Observation:
        """Observation of a state, with deformation, stress and energy."""
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
