"""How much of a place a body fills: smoothed, so that a lattice does not show."""

from __future__ import annotations

from math import pi
from typing import ClassVar, final

import attrs
import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.spatial import cKDTree

from solidsph.arrays import Array, Indices, Scalar
from solidsph.body import Body
from solidsph.interfaces.kernel import Kernel
from solidsph.smoothing import SmoothingKernel, smoothing_kernel

REACH = 2.5
"""Support of the smoothing in spacings: beside a lattice the place where two bodies touch then
varies by less than a thousandth of a spacing, in 2D by less than a ten-thousandth."""

# Passes that give edges and corners their weight; each halves what is missing there.
_PASSES = 6
_LARGEST_WEIGHT = 3.0

_NODES, _WEIGHTS = leggauss(64)


@final
@attrs.frozen
class _QuinticSpline(Kernel):
    """The M6 spline of Schoenberg (1946): it keeps a constant on a lattice to 3e-4."""

    knots: ClassVar[tuple[float, ...]] = (1.0 / 3.0, 2.0 / 3.0)

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (
            np.maximum(1.0 - q, 0.0) ** 5
            - 6.0 * np.maximum(2.0 / 3.0 - q, 0.0) ** 5
            + 15.0 * np.maximum(1.0 / 3.0 - q, 0.0) ** 5
        )

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (
            -5.0 * np.maximum(1.0 - q, 0.0) ** 4
            + 30.0 * np.maximum(2.0 / 3.0 - q, 0.0) ** 4
            - 75.0 * np.maximum(1.0 / 3.0 - q, 0.0) ** 4
        )


@attrs.frozen(eq=False)
class Sites:
    """Particles of a body that may touch others."""

    particles: Indices  # (m,) among those of all bodies
    volumes: Array  # (m,) V [m^d]
    weights: Array  # (m,) what they fill: V, and more in corners and at edges [m^d]
    room: Array  # (m,) the part around each that the body leaves to others [-]
    depths: Array  # (m,) below the surface, where that is less than half a spacing, or that [m]


def crowding_kernel(dimension: int, radius: float) -> SmoothingKernel:
    """W of a support radius [m]."""
    return smoothing_kernel(_QuinticSpline(), dimension, radius)


def steepest(kernel: SmoothingKernel) -> float:
    """The largest change of what a body fills on the way into it [1/m]: at its surface."""
    return float(_layer(kernel, np.zeros(1))[0])


def sensitivity(kernel: SmoothingKernel, excess: float) -> float:
    """What K / rho is multiplied by in the square of a frequency of contact, at most [1/m^2].

    The excess of a particle has the gradient g, and K V g g^T is its stiffness. The Gram matrix
    of all g, by mass, has no row whose absolute values add up to more than the square of the
    integral of |dW/dr|. What a push bends adds twice the integral of |W''| times the excess.
    """
    d, H = kernel.dimension, kernel.support_radius
    r = np.linspace(0.0, H, 2001)
    slope = kernel.slope(r)
    middle = 0.5 * (r[1:] + r[:-1])
    area = {1: np.full(2000, 2.0), 2: 2.0 * pi * middle, 3: 4.0 * pi * middle**2}[d]
    first = float(area @ np.abs(0.5 * (slope[1:] + slope[:-1]))) * H / 2000
    second = float(area @ np.abs(np.diff(slope)))
    return first**2 + 2.0 * excess * second


def sites(body: Body, kernel: SmoothingKernel, *, near_surface: bool = False) -> Sites:
    """The particles of a body that have a mass, or only those `near_surface`.

    What a body leaves free around a particle is 1 - sum of V W over its own particles, so that
    two surfaces touch where the two sums together make 1, wherever in their cells the particles
    stand. An edge or a corner leaves more than the plane face does, and would sink in before it
    touches; so what is left to others is at most what a plane face leaves at the particle's depth,
    and the particles nearby count for more, until they fill what is not left.
    """
    particles = body.particles
    X, V = particles.positions, particles.volumes
    real = np.flatnonzero(~particles.ghosts)
    spacing = float(particles.spacings[real].max())
    depths = _depths(body, spacing)
    owners = real[np.isfinite(depths[real])]
    near = real
    if owners.size:
        gaps = cKDTree(X[owners]).query(X[real])[0]
        near = real[gaps <= kernel.support_radius]
    found = cKDTree(X[near]).sparse_distance_matrix(
        cKDTree(X[real]), kernel.support_radius, output_type="ndarray"
    )
    order = np.lexsort((found["j"], found["i"]))
    rows, columns, distances = (found[name][order] for name in ("i", "j", "v"))
    terms = kernel.value(distances) * V[real][columns]

    filled = np.bincount(rows, terms, len(near))
    plane = _filled_by_half_space(kernel, spacing, depths[near])
    wanted = np.maximum(filled, plane)
    weight = np.ones(len(real))
    places = np.searchsorted(real, near)
    for _ in range(_PASSES):
        missing = wanted - np.bincount(rows, terms * weight[columns], len(near))
        weight[places] = np.clip(weight[places] + missing, 0.5, _LARGEST_WEIGHT)
    room = np.zeros(len(real))
    room[places] = np.maximum(0.0, 1.0 - wanted)
    chosen = places if near_surface else np.arange(len(real))
    return Sites(
        particles=real[chosen] + body.extent.start,
        volumes=V[real][chosen],
        weights=(weight * V[real])[chosen],
        room=room[chosen],
        depths=np.minimum(depths[real], 0.5 * spacing)[chosen],
    )


def _depths(body: Body, spacing: float) -> Array:
    """How deep below the surface particles that own some of it stand, (n,) [m]; others inf.

    A cell on a plane face has the volume of the column from the surface to half a spacing below
    its particle.
    """
    particles = body.particles
    depths = np.full(particles.count, np.inf)
    for face in particles.faces.values():
        owners, areas = face.particles, face.areas
        column = particles.volumes[owners] / np.where(areas > 0.0, areas, np.inf)
        below = np.where(areas > 0.0, column - 0.5 * spacing, np.inf)
        depths[owners] = np.minimum(depths[owners], np.clip(below, 0.0, None))
    # Of what owns a sliver of a face nothing can be told.
    depths[depths > spacing] = np.inf
    return depths


def _filled_by_half_space(kernel: SmoothingKernel, spacing: float, depths: Array) -> Array:
    """What layers of particles below a plane surface fill at `depths` (m,) below it, (m,) [-].

    0 where the depth is infinite.
    """
    layers = (np.arange(int(2.0 * kernel.support_radius / spacing) + 2) + 0.5) * spacing
    finite = np.isfinite(depths)
    filled = np.zeros(len(depths))
    away = np.abs(layers[None, :] - depths[finite][:, None])
    filled[finite] = spacing * _layer(kernel, away.ravel()).reshape(away.shape).sum(axis=1)
    return filled


def _layer(kernel: SmoothingKernel, heights: Array) -> Array:
    """W integrated over the plane so far away, (m,) [1/m]."""
    d, H = kernel.dimension, kernel.support_radius
    if d == 1:
        return kernel.value(heights)
    widest = np.sqrt(np.maximum(H**2 - heights**2, 0.0))
    across = 0.5 * widest[:, None] * (_NODES + 1.0)
    values = kernel.value(np.sqrt(heights[:, None] ** 2 + across**2))
    area = 2.0 if d == 2 else 2.0 * pi * across
    result: Array = 0.5 * widest * np.sum(_WEIGHTS * area * values, axis=1)
    return result
