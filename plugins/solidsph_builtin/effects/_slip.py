"""Coulomb's friction as a spring that slides."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array


def slid(
    slip: Array, velocity: Array, normals: Array, step: float, stiffness: Array, limits: Array
) -> Array:
    """Stretch of the springs (k, d) [m] after a step; the force is -stiffness times it.

    Each is stretched by the tangential motion and gives way where it would pull with more than its
    limit. Cundall & Strack (1979).

    Args:
        slip: stretch before the step, (k, d) [m].
        velocity: of the particle relative to what it touches, (k, d) [m/s].
        normals: of the surface touched, (k, d).
        step: [s]; 0 changes nothing.
        stiffness: (k,) [N/m].
        limits: the normal force times the coefficient, (k,) [N].
    """
    if step == 0.0:
        return slip
    trial = slip + step * velocity
    # What the normal has turned by since the last step must not remain in it.
    trial -= np.sum(trial * normals, axis=1)[:, None] * normals
    pull = stiffness * np.linalg.norm(trial, axis=1)
    part = np.where(pull > limits, limits / np.where(pull > 0.0, pull, 1.0), 1.0)
    return np.asarray(trial * part[:, None])
