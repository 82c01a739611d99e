"""Smoothed volume fraction of a body, in which a lattice does not show."""

from __future__ import annotations

from math import pi
from typing import ClassVar, final

import attrs
import numpy as np
from numpy.polynomial.legendre import leggauss

from solidsph.interfaces.body import Body
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import SmoothingKernel, smoothing_kernel
from solidsph.maths.arrays import Array, Indices, Scalar

REACH = 2.5
"""Support radius of the smoothing in spacings: along a lattice the position at which bodies touch
then varies by less than a thousandth of a spacing, in 2D by less than a ten-thousandth."""

_NODES, _WEIGHTS = leggauss(64)

# Number of depths at which the volume fraction beside a plane face is tabulated; interpolation is
# then right to 1e-6.
_TABULATED = 1000

# Particles this close to the depth of a row belong to it, in spacings.
_ROW = 0.3


@final
@attrs.frozen
class _QuinticSpline(Kernel):
    """The M6 spline of Schoenberg (1946), which reproduces a constant on a lattice to 3e-4."""

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
    """Particles of a body that may touch another body."""

    particles: Indices  # (m,) among those of all bodies
    positions: Array  # (m, d) X [m]
    volumes: Array  # (m,) V [m^d]
    room: Array  # (m,) volume fraction around each that the other may fill [-]
    depths: Array  # (m,) below the surface of the body [m]


def crowding_kernel(dimension: int, radius: float) -> SmoothingKernel:
    """The smoothing kernel with a support radius [m]."""
    return smoothing_kernel(_QuinticSpline(), dimension, radius)


def steepest(kernel: SmoothingKernel) -> float:
    """Largest gradient of the volume fraction of a body, at its surface [1/m]."""
    return float(_layer(kernel, np.zeros(1))[0])


def sensitivity(kernel: SmoothingKernel, excess: float) -> float:
    """Bound on the squared angular frequency of contact, over K / rho [1/m^2].

    The excess of a particle has the gradient g, and K V g g^T is its stiffness. The absolute values
    in a row of the mass-weighted Gram matrix of all g add up to at most the square of the integral
    of |dW/dr|. The geometric stiffness adds twice the integral of |W''| times the excess.
    """
    d, H = kernel.dimension, kernel.support_radius
    r = np.linspace(0.0, H, 2001)
    slope = kernel.slope(r)
    middle = 0.5 * (r[1:] + r[:-1])
    area = {1: np.full(2000, 2.0), 2: 2.0 * pi * middle, 3: 4.0 * pi * middle**2}[d]
    first = float(area @ np.abs(0.5 * (slope[1:] + slope[:-1]))) * H / 2000
    second = float(area @ np.abs(np.diff(slope)))
    return first**2 + 2.0 * excess * second


def sites(body: Body, other: Body, kernel: SmoothingKernel, *, near_surface: bool = False) -> Sites:
    """The particles of a body, or only those `near_surface`, that may touch the `other`.

    Around a particle below a plane face, a body whose plane face lies on that face has a volume
    fraction that depends on the particle's depth and on the rows of particles of the other body,
    because a sum over rows is not the integral. That fraction is the particle's room, so that faces
    touch where their surfaces are, however both bodies are divided. Less than a plane face, such as
    an edge, never fills more.
    """
    own = body.particles
    real = np.flatnonzero(~own.ghosts)
    depths = np.maximum(0.0, -body.shape.signed_distance(own.positions[real]))
    if near_surface:
        near = depths < kernel.support_radius
        real, depths = real[near], depths[near]
    return Sites(
        particles=real + body.extent.start,
        positions=own.positions[real],
        volumes=own.volumes[real],
        room=_filled_beside(other, kernel, depths),
        depths=depths,
    )


def _filled_beside(body: Body, kernel: SmoothingKernel, heights: Array) -> Array:
    """Volume fraction of the body at `heights` (m,) above a plane face of it [m], (m,) [-]."""
    table = np.linspace(0.0, kernel.support_radius, _TABULATED)
    filled = np.zeros(_TABULATED)
    for depth, thickness in _rows(body, kernel.support_radius):
        filled += thickness * _layer(kernel, table + depth)
    return np.interp(heights, table, filled)


def _rows(body: Body, reach: float) -> list[tuple[float, float]]:
    """Depth and thickness of the rows of particles below a plane face, down to `reach` [m].

    The first is at the median depth of the particles that own the surface: half a spacing for
    centres of cells, and 0 on the surface. A row is as thick as its particles' volumes say, which
    for particles on the surface are a half of the others, or what a fit of volumes gives them.
    """
    own = body.particles
    spacing = float(np.median(own.spacings[~own.ghosts]))
    owners = np.any(own.area_vectors != 0.0, axis=1) & ~own.ghosts
    first = 0.5 * spacing
    if owners.any():
        first = float(np.median(-body.shape.signed_distance(own.positions[owners])))
        first = min(max(first, 0.0), spacing)
    depths = np.arange(first, reach, spacing)
    real = ~own.ghosts
    below = -body.shape.signed_distance(own.positions[real])
    thick = own.volumes[real] / spacing ** (own.dimension - 1)
    rows = []
    for k, z in enumerate(depths):
        there = thick[np.abs(below - z) < _ROW * spacing]
        usual = spacing if k else first + 0.5 * spacing
        rows.append((float(z), float(np.median(there)) if there.size else usual))
    return rows


def _layer(kernel: SmoothingKernel, heights: Array) -> Array:
    """W integrated over a plane at distances `heights` (m,) [m], (m,) [1/m]."""
    d, H = kernel.dimension, kernel.support_radius
    if d == 1:
        return kernel.value(heights)
    widest = np.sqrt(np.maximum(H**2 - heights**2, 0.0))
    across = 0.5 * widest[:, None] * (_NODES + 1.0)
    values = kernel.value(np.sqrt(heights[:, None] ** 2 + across**2))
    area = 2.0 if d == 2 else 2.0 * pi * across
    result: Array = 0.5 * widest * np.sum(_WEIGHTS * area * values, axis=1)
    return result
