"""The stable step: the highest frequency of the forces as they are, by Arnoldi's iteration."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse.linalg import LinearOperator, eigs

from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene

# Differences over this part of a spacing: the error of the second order formula is its square.
_RELATIVE_STEP = 1e-3

# Of the eigenvalue, which is the square of the frequency.
_TOLERANCE = 1e-3

# Up to this size a dense matrix is as cheap.
_SMALL = 40


@attrs.frozen
class StableStep:
    """The largest stable time step of a scene."""

    highest_frequency: float  # [rad/s]
    step: float  # largest stable step [s]
    in_use: float  # the step that the scene runs with [s]

    @property
    def margin(self) -> float:
        """Largest stable step over that in use; below 1 the run blows up."""
        return self.step / self.in_use


def highest_frequency(simulation: BuiltScene, state: State | None = None) -> float:
    """Largest angular frequency of small deviations from `state` [rad/s], to 0.1 %.

    Matrix-free: products with the linearised forces are differences of `Dynamics.respond` at
    rest, so every active effect and any engine counts, in either Lagrangian form.

    Args:
        simulation: any built scene.
        state: where to linearise; the start of the scene by default.
    """
    dynamics = simulation.dynamics
    around = simulation.initial if state is None else state
    positions = dynamics.place(around.time, around.positions)
    rest = np.zeros_like(positions)
    spacing = float(dynamics.particles.spacings.min())
    free = np.repeat(~dynamics.particles.ghosts[:, None], positions.shape[1], axis=1)
    for motion in dynamics.constraints:
        free &= ~motion.held
    count = int(free.sum())
    if count == 0:
        return 0.0

    def accelerations(deviation: Array) -> Array:
        moved = positions.copy()
        moved[free] += deviation
        placed = dynamics.place(around.time, moved)
        response: Array = dynamics.respond(around.time, placed, rest).accelerations[free]
        return response

    def stiffness_over_mass(direction: Array) -> Array:
        direction = direction.reshape(count)
        largest = float(np.abs(direction).max())
        if largest == 0.0:
            return np.zeros(count)
        h = _RELATIVE_STEP * spacing / largest
        return (accelerations(-h * direction) - accelerations(h * direction)) / (2.0 * h)

    if count <= _SMALL:
        dense = np.column_stack([stiffness_over_mass(column) for column in np.eye(count)])
        squares = np.linalg.eigvals(dense)
    else:
        squares = eigs(
            LinearOperator((count, count), matvec=stiffness_over_mass, dtype=np.float64),
            k=1,
            which="LR",
            tol=_TOLERANCE,
            v0=np.random.default_rng(0).standard_normal(count),
            return_eigenvectors=False,
        )
    return float(np.sqrt(max(0.0, squares.real.max())))


def critical_step(simulation: BuiltScene, state: State | None = None) -> StableStep:
    """The largest stable step from the spectrum, beside the one in use.

    Damping counts by the rates that effects declare, as in the step chosen from wave speed and
    spacing, for which this is the true margin.
    """
    frequency = highest_frequency(simulation, state)
    rate = sum(load.damping_rate for load in simulation.dynamics.loads)
    limit = simulation.integrator.stability_limit
    total = frequency + rate
    return StableStep(
        highest_frequency=frequency,
        step=limit / total if total > 0.0 else float("inf"),
        in_use=simulation.step_size,
    )
