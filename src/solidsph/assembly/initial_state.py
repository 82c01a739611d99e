"""State at the start of a scene, and the observation of its reference configuration."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Constraint, Load, Observation, Term
from solidsph.model.fields import VectorField
from solidsph.model.particles import Particles, State
from solidsph.model.regions import select
from solidsph.scene.scene_data import SceneData


def initial_state(scene: SceneData, particles: Particles) -> State:
    """Initial positions and velocities of the scene.

    Raises:
        SceneError: a place or a formula is wrong.
    """
    # By shape and not `zeros_like`: pages of zeros that are never written take no memory.
    displacements = np.zeros(particles.positions.shape)
    velocities = np.zeros(particles.positions.shape)
    for entry in scene.initial:
        chosen = select(particles, entry.where)
        for table, values, what in (
            (entry.displacement, displacements, "initial: displacement"),
            (entry.velocity, velocities, "initial: velocity"),
        ):
            if table is None:
                continue
            field = VectorField.of(table, what)
            field.check_dimension(particles.dimension, what)
            field.check_without("t", "it is the state at t = 0: use numbers, X, Y and Z")
            X = particles.positions[chosen]
            for axis in field.components:
                values[chosen, axis] = field.values(axis, X, 0.0)
    return State(
        time=0.0,
        step=0,
        positions=particles.positions + displacements,
        velocities=velocities,
        accelerations=np.zeros(velocities.shape),
    )


def reference_observation(
    initial: State, model: DiscreteModel, terms: Sequence[Term]
) -> Observation:
    """The undeformed scene at rest without forces."""
    n, d = initial.positions.shape
    # Views of a single number, which take no memory.
    scalars, vectors = np.broadcast_to(0.0, n), np.broadcast_to(0.0, (n, d))
    dissipates = any(isinstance(body.material, HistoryMaterial) for body in model.bodies)
    labels = [term.label for term in terms if isinstance(term, (Load, Constraint))]
    return Observation(
        state=attrs.evolve(
            initial,
            positions=model.particles.positions,
            velocities=vectors,
            accelerations=vectors,
            applied=dict.fromkeys(labels, vectors),
            work=dict.fromkeys(labels, 0.0),
        ),
        particles=model.particles,
        masses=model.masses,
        deformation_gradients=np.broadcast_to(np.eye(d), (n, d, d)),
        stresses=np.broadcast_to(0.0, (n, d, d)),
        energy_densities=scalars,
        dissipated_densities=scalars if dissipates else None,
    )
