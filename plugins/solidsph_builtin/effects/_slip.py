"""Coulomb friction as a spring that slides."""

from __future__ import annotations

import attrs
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
    trial = _stretched(slip, step * velocity, normals)
    pull = stiffness * np.linalg.norm(trial, axis=1)
    part = np.where(pull > limits, limits / np.where(pull > 0.0, pull, 1.0), 1.0)
    return np.asarray(trial * part[:, None])


@attrs.frozen(eq=False)
class SlipStiffness:
    """Derivatives of the force on each spring's particle, `stiffness` times `slid`."""

    by_motion: Array  # (k, d, d) by the relative motion in the step [N/m]
    by_limit: Array  # (k, d) by the limit force [-]; 0 where the spring sticks


def slip_stiffness(
    slip: Array, motion: Array, normals: Array, stiffness: Array, limits: Array
) -> SlipStiffness:
    """Stiffness of `slid` for a relative motion (k, d) [m] in the step: its consistent tangent.

    Normals are taken as constant.
    """
    trial = _stretched(slip, motion, normals)
    size = np.linalg.norm(trial, axis=1)
    sliding = stiffness * size > limits
    along = trial / np.where(size > 0.0, size, 1.0)[:, None]
    tangential = np.eye(trial.shape[1]) - normals[:, :, None] * normals[:, None, :]
    turning = tangential - along[:, :, None] * along[:, None, :]
    held = limits / np.where(sliding, size, 1.0)
    return SlipStiffness(
        np.where(
            sliding[:, None, None],
            held[:, None, None] * turning,
            stiffness[:, None, None] * tangential,
        ),
        np.where(sliding[:, None], along, 0.0),
    )


def _stretched(slip: Array, motion: Array, normals: Array) -> Array:
    """Stretch (k, d) without its normal component, which a rotation of the normal would leave."""
    trial = slip + motion
    return np.asarray(trial - np.sum(trial * normals, axis=1)[:, None] * normals)
