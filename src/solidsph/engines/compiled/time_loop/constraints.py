"""Constraints in the compiled loop."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.interfaces.compilable_terms import LinearExtension, ScheduledConstraint
from solidsph.interfaces.terms import Constraint
from solidsph.maths.arrays import Array, Indices


class ScheduledMotion(NamedTuple):
    """A motion known ahead: values for the steps to come, or one row for all of them."""

    particles: Indices  # (m,)
    axes: Indices  # (m,)
    displacements: Array  # (t, m) [m]
    velocities: Array  # (t, m) [m/s]
    accelerations: Array  # (t, m) [m/s^2]
    before: Array  # (m,) reaction at the end of the last step [N]
    work: Array  # (1,) so far [J]


class FollowingGhosts(NamedTuple):
    """Ghosts whose values are weighted sums of those of other particles."""

    ghosts: Indices  # (k,)
    signs: Array  # (k, d)
    starts: NDArray[np.int32]  # rows of the matrix
    columns: NDArray[np.int32]
    weights: Array
    work: Array  # (1,) stays 0: ghosts return the work that they take from other particles


class ConstraintCalls(NamedTuple):
    """The compiled functions of a constraint."""

    move: Any  # (motion, step, dt, u, h, path, v): before the forces, displacement and velocity
    hand_on: Any  # (motion, total): forces on ghosts go to those they follow
    # (motion, step, masses, total, path, a, v): after them, acceleration, reaction and velocity
    react: Any


def constraint_calls(motion: Constraint, dimension: int) -> ConstraintCalls:
    """The compiled functions for the kind of a constraint.

    Raises:
        NotCompilableError: it is not of a compilable kind.
    """
    match motion:
        case ScheduledConstraint():
            return _scheduled()
        case LinearExtension():
            return _following(dimension)
    raise NotCompilableError(f"motion {motion.label!r} is not of a compilable kind")


def constraint_data(
    motion: Constraint, times: Array, before: Array, step: float
) -> ScheduledMotion | FollowingGhosts:
    """The data of a constraint for steps that end at `times` (t,) [s].

    `before` (m,) is its reaction at the beginning [N], `step` the time step [s].
    """
    match motion:
        case ScheduledConstraint():
            particles, axes = motion.entries
            u, v, a = (np.ascontiguousarray(motion.schedule(times, k, step)) for k in range(3))
            return ScheduledMotion(particles, axes, u, v, a, before, np.zeros(1))
        case LinearExtension():
            return following(motion, motion.displacement)
    raise AssertionError("constraint_calls has refused it")


def following(extension: LinearExtension, weights: csr_array) -> FollowingGhosts:
    """Ghosts that follow by `weights` (k, n)."""
    rows = weights.indptr, weights.indices, weights.data
    return FollowingGhosts(extension.ghosts, extension.signs, *rows, np.zeros(1))


@njit
def _now(table: Array, step: int) -> Array:
    """The row of a step; a single row is for all steps."""
    row: Array = table[min(step, len(table) - 1)]
    return row


@cache
def _scheduled() -> ConstraintCalls:
    @njit
    def move(motion, step, dt, u, h, path, v):
        displacements, velocities = _now(motion.displacements, step), _now(motion.velocities, step)
        for m in range(len(motion.particles)):
            p, i = motion.particles[m], motion.axes[m]
            change = displacements[m] - u[p, i]
            u[p, i] = displacements[m]
            path[p, i] += change
            h[p, i] += change / dt
            v[p, i] = velocities[m]

    @njit
    def hand_on(motion, total):
        pass

    @njit
    def react(motion, step, masses, total, path, a, v):
        velocities, accelerations = _now(motion.velocities, step), _now(motion.accelerations, step)
        work = 0.0
        for m in range(len(motion.particles)):
            p, i = motion.particles[m], motion.axes[m]
            a[p, i] = accelerations[m]
            v[p, i] = velocities[m]
            reaction = masses[p] * a[p, i] - total[p, i]
            work += 0.5 * (motion.before[m] + reaction) * path[p, i]
            motion.before[m] = reaction
        motion.work[0] += work

    return ConstraintCalls(move, hand_on, react)


@cache
def _following(dimension: int) -> ConstraintCalls:
    @njit
    def followed(motion, k, i, values):
        total = 0.0
        for m in range(motion.starts[k], motion.starts[k + 1]):
            total += motion.weights[m] * values[motion.columns[m], i]
        return motion.signs[k, i] * total

    @njit
    def move(motion, step, dt, u, h, path, v):
        for k in range(len(motion.ghosts)):
            p = motion.ghosts[k]
            for i in range(dimension):
                change = followed(motion, k, i, u) - u[p, i]
                u[p, i] += change
                path[p, i] += change
                h[p, i] += change / dt
                v[p, i] = followed(motion, k, i, v)

    @njit
    def hand_on(motion, total):
        for k in range(len(motion.ghosts)):
            p = motion.ghosts[k]
            for i in range(dimension):
                force = motion.signs[k, i] * total[p, i]
                for m in range(motion.starts[k], motion.starts[k + 1]):
                    total[motion.columns[m], i] += motion.weights[m] * force
                total[p, i] = 0.0

    @njit
    def react(motion, step, masses, total, path, a, v):
        for k in range(len(motion.ghosts)):
            p = motion.ghosts[k]
            for i in range(dimension):
                a[p, i] = followed(motion, k, i, a)
                v[p, i] = followed(motion, k, i, v)

    return ConstraintCalls(move, hand_on, react)
