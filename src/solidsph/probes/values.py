"""Values: displacement, velocity, deformation and stress at points of the reference bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import attrs
import numpy as np
from numpy.typing import ArrayLike

from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.model.particles import Particles
from solidsph.probes.sampling import Sampling, located


@attrs.frozen(eq=False)
class Values:
    """Fields at m points, by interpolation of the second order up to the surface."""

    points: Array  # (m, d) reference positions X [m]
    displacement: Array  # (m, d) u [m]
    velocity: Array  # (m, d) v [m/s]
    F: Array  # (m, d, d) deformation gradient, of the interpolated motion [-]
    stress: Array  # (m, d, d) Cauchy stress [Pa]


def values_at(
    shapes: Mapping[str, Shape],
    particles: Particles,
    points: ArrayLike,
    body: str | None,
    *,
    positions: Array,
    velocities: Array,
    stress: Callable[[Indices], Array],
) -> Values:
    """Values at points, by the fields of all particles.

    Args:
        shapes: of all bodies, by name.
        particles: of all bodies.
        points: reference positions, (m, d) or (d,) [m].
        body: the body, where several touch.
        positions: current ones, (n, d) [m].
        velocities: (n, d) [m/s].
        stress: gives the Cauchy stress (k, d, d) [Pa] of particles (k,).

    Raises:
        SceneError: a point lies outside of every body.
    """
    at = Sampling.of(shapes, particles, *located(shapes, particles, points, body))
    u = (positions - particles.positions)[at.particles]
    return Values(
        points=at.points,
        displacement=at.interpolated(u),
        velocity=at.interpolated(velocities[at.particles]),
        F=np.eye(particles.dimension) + at.gradients(u),
        stress=at.interpolated(stress(at.particles)),
    )


def cauchy_stress(observation: Observation, particles: Indices) -> Array:
    """Cauchy stress P F^T / J of particles (k,), (k, d, d) [Pa]."""
    F, P = observation.deformation_gradients[particles], observation.stresses[particles]
    ratios = observation.volume_ratios[particles]
    return np.asarray(np.einsum("pik,pjk->pij", P, F) / ratios[:, None, None])
