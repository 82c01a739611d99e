"""Critical time step from the highest frequency of the forces, by Arnoldi iteration."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse.linalg import LinearOperator, eigs

from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.run.safe_step import stable_step_of

# Differences over this fraction of a spacing; the error of central differences is its square.
_RELATIVE_STEP = 1e-3

# Relative, of the eigenvalue, the square of the frequency.
_TOLERANCE = 1e-3

# Up to this number of unknowns a dense matrix is as cheap.
_SMALL = 40


@attrs.frozen
class StableStep:
    """The largest stable time step of a scene."""

    highest_frequency: float  # [rad/s]
    step: float  # largest stable step [s]
    in_use: float  # step of the scene [s]

    @property
    def margin(self) -> float:
        """Largest stable step over the step of the scene; below 1 the run diverges."""
        return self.step / self.in_use


def highest_frequency(simulation: BuiltScene, state: State | None = None) -> float:
    """Largest angular frequency of small deviations from `state` [rad/s], to 0.1 %.

    Matrix-free: the linearised forces are differences of `Dynamics.respond` at rest, with all
    effects, for any engine and formulation.

    Args:
        simulation: any built scene.
        state: linearisation point; the initial state by default.
    """
    dynamics = simulation.dynamics
    around = simulation.initial if state is None else state
    positions = dynamics.place(around.time, around.positions)
    rest = np.zeros_like(positions)
    spacing = float(dynamics.particles.spacings.min())
    free = dynamics.free
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
    """Largest stable step from the spectrum, compared with the step of the scene.

    Damping, and loads that the state may not show, enter by the rates that they declare.
    """
    frequency = highest_frequency(simulation, state)
    loads = simulation.dynamics.loads
    return StableStep(
        highest_frequency=frequency,
        step=stable_step_of(frequency**2, simulation.integrator, loads),
        in_use=simulation.step_size,
    )
