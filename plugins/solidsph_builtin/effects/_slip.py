"""Coulomb friction as a spring that slides."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array


def slid(
    slip: Array, velocity: Array, normals: Array, step: float, stiffness: Array, limits: Array
) -> Array:
    """Stretch of the springs after a step, (k, d) [m]; the force is -stiffness times it.

    The tangential motion stretches each spring, which slides at its limit force. Cundall & Strack
    (1979).

    Args:
        slip: stretch before the step, (k, d) [m].
        velocity: of the particle relative to the surface that it touches, (k, d) [m/s].
        normals: of that surface, (k, d).
        step: length of the step [s]; 0 changes nothing.
        stiffness: (k,) [N/m].
        limits: normal force times the coefficient of friction, (k,) [N].
    """
    if step == 0.0:
        return slip
    trial = slip + step * velocity
    # Remove the normal component, which a rotation of the normal would leave in it.
    trial -= np.sum(trial * normals, axis=1)[:, None] * normals
    pull = stiffness * np.linalg.norm(trial, axis=1)
    part = np.where(pull > limits, limits / np.where(pull > 0.0, pull, 1.0), 1.0)
    return np.asarray(trial * part[:, None])
