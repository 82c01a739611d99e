"""Loss of ellipticity: whether a stretched material still carries waves in every direction.

A small plane wave a f(N . X - c t) about a uniform deformation F obeys rho_0 c^2 a = A(N) a with
the acoustic tensor A(N) a = (dP/dF : a (x) N) N. If an eigenvalue of A is negative for some
direction N, ellipticity is lost: the deformation localises, the faster the finer it is resolved.
This is a property of the material; no discretisation may hide it.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import attrs
import numpy as np
from scipy.optimize import brentq

from solidsph.errors import SolidsphError
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first

# Directions are searched on a grid of angles, then on finer grids in the plane normal to the best,
# which have no pole: the error of the eigenvalue is the square of the last grid's spacing, 8e-6.
_POINTS = 41
_FINER = 0.1  # two spacings of the grid before
_GRIDS = 5


@attrs.frozen(eq=False)
class Stiffness:
    """The least resistance of a deformed material to a plane wave."""

    value: float  # smallest eigenvalue of the acoustic tensors of all directions, rho_0 c^2 [Pa]
    direction: Array  # N in the reference configuration, (d,)


def acoustic_tensors(material: Material, F: Array, directions: Array) -> Array:
    """A(N) of every direction, (m, d, d) [Pa].

    Args:
        F: deformation gradient, (d, d).
        directions: unit vectors N in the reference configuration, (m, d).
    """
    count, d = directions.shape
    everywhere = components_first(np.broadcast_to(F, (count, d, d)))
    tensors = np.empty((count, d, d))
    for j in range(d):
        change = np.zeros((count, d, d))
        change[:, j, :] = directions
        dP = particles_first(
            material.tangent(everywhere, components_first(change), material.params), count
        )
        tensors[:, :, j] = np.einsum("mik,mk->mi", dP, directions)
    return tensors


def least_stiffness(material: Material, F: Array) -> Stiffness:
    """The smallest eigenvalue of the acoustic tensors at F (d, d), and its direction."""
    across, width = len(F) - 1, 0.5 * np.pi
    directions = _directions(0.5 * np.pi + _grid(across, width))
    for _ in range(_GRIDS):
        # Symmetric, since the stress has an energy.
        values = np.linalg.eigvalsh(acoustic_tensors(material, F, directions))[:, 0]
        best = int(np.argmin(values))
        least = Stiffness(float(values[best]), directions[best])
        width *= _FINER
        directions = _around(least.direction, _grid(across, width))
    return least


def losses_of_ellipticity(
    material: Material,
    path: Callable[[float], Array],
    start: float,
    end: float,
    *,
    samples: int = 100,
) -> list[float]:
    """Parameters at which the least stiffness changes its sign along `path`, in rising order.

    Args:
        path: F (d, d) at a value of the path's parameter, such as a stretch.
        start: first parameter.
        end: last parameter.
        samples: number of values tried; two changes between adjacent values are missed.

    Raises:
        SolidsphError: the material is not elliptic at the start.
    """

    def stiffness(parameter: float) -> float:
        return least_stiffness(material, path(parameter)).value

    if stiffness(start) <= 0.0:
        raise SolidsphError(
            f"{type(material).__name__} is not elliptic at the start of the path, {start:g}; start "
            "where it is, such as at the identity"
        )
    at = np.linspace(start, end, samples)
    values = np.array([stiffness(float(parameter)) for parameter in at])
    changes = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return [float(brentq(stiffness, at[k], at[k + 1], xtol=1e-12)) for k in changes]


def _grid(dimension: int, width: float) -> Array:
    """Points (m, dimension) from -width to width along every axis."""
    offsets = np.linspace(-width, width, _POINTS)
    return np.array(list(product(offsets, repeat=dimension)))


def _around(direction: Array, offsets: Array) -> Array:
    """Unit vectors (m, d) by offsets (m, d - 1) in the plane normal to a direction."""
    _, _, basis = np.linalg.svd(direction[None, :])
    vectors = direction + offsets @ basis[1:]
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _directions(angles: Array) -> Array:
    """Unit vectors (m, d) from d - 1 angles each: none, the polar angle, or both of a sphere."""
    if angles.shape[1] == 0:
        return np.ones((len(angles), 1))
    if angles.shape[1] == 1:
        return np.column_stack([np.cos(angles[:, 0]), np.sin(angles[:, 0])])
    polar, azimuth = angles.T
    return np.column_stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
