"""Where a surface is curved, and how much: from samples of it, whatever the shape.

On a smooth surface the normal turns by W dx over a way dx, and the largest principal value of W is
one over the smallest radius of curvature. W is fitted to the samples around each place, by least
squares. An edge has none: looked at from half as far, it seems to bend twice as much. So only what
three looks agree upon counts, each from twice as far as the one before. The facets of a mesh are
edges from close by, and a curve from further away.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.scene.surface_levels import BEND, Level, first_level

# Cubes over the smallest radius that is looked for.
_SIZE = 0.1
# Distance of neighbours, in cubes.
_REACH = 3.5
# Looks that must agree, and the smallest of them over the largest.
_LOOKS, _AGREE = 3, 0.75
# Neighbours whose spread across their line is less than this part of that along it, squared, are in
# one line, and tell nothing of how the surface turns across it.
_IN_LINE = 0.02


def curved_places(
    shape: Shape, least: float, greatest: float, finest: float
) -> tuple[Array, Array]:
    """Places on a surface that are curved, (m, d) [m], and their smallest radius of curvature, (m,)
    [m].

    Args:
        shape: whose surface it is; that of a line has no curvature.
        least: smallest radius that is looked for [m].
        greatest: largest radius that is looked for [m].
        finest: least size of what is looked at [m].
    """
    if shape.dimension == 1:
        return np.zeros((0, 1)), np.zeros(0)
    level = first_level(shape, max(_SIZE * least, finest))
    levels = [level]
    parents = []
    while level.size <= _SIZE * greatest or len(levels) < _LOOKS:
        level, parent = level.coarser(2.0 * level.size)
        levels.append(level)
        parents.append(parent)
    seen = [_curvatures(level)]  # of this level and coarser ones, at its places
    points, radii = [], []
    for level, parent in zip(levels[-2::-1], parents[::-1], strict=True):
        seen = [_curvatures(level), *(look[parent] for look in seen[: _LOOKS - 1])]
        if len(seen) == _LOOKS:
            looks = np.stack(seen)
            agree = looks.min(axis=0) > _AGREE * looks.max(axis=0)
            points.append(level.points[agree])
            radii.append(1.0 / looks[:, agree].mean(axis=0))
    found = np.concatenate(radii)
    wanted = found <= greatest
    return np.concatenate(points)[wanted], found[wanted]


def _curvatures(level: Level) -> Array:
    """The largest principal curvature at each place, (m,) [1/m]."""
    m, d = level.points.shape
    ways = level.directions
    X = level.points - level.points.mean(axis=0)
    products = np.einsum("mi,mj->mij", np.column_stack([X, level.normals]), X).reshape(m, -1)
    features = np.column_stack([np.ones(m), X, level.normals, products])
    sums = np.zeros_like(features)
    for a, b in level.near(_REACH * level.size):
        smooth = np.einsum("mi,mi->m", ways[a], ways[b]) > BEND
        a, b = a[smooth], b[smooth]
        sums += coo_array((level.areas[b], (a, b)), shape=(m, m)).tocsr() @ features
    sums[:, 1:] /= sums[:, :1]
    x, n = sums[:, 1 : 1 + d], sums[:, 1 + d : 1 + 2 * d]
    both = sums[:, 1 + 2 * d :].reshape(m, 2 * d, d)
    both -= np.einsum("mi,mj->mij", np.column_stack([x, n]), x)
    along = _tangents(ways)
    spread, turn = np.einsum("mki,mpkj,mjl->pmil", along, both.reshape(m, 2, d, d), along)
    W = turn @ np.linalg.pinv(spread, rcond=_IN_LINE, hermitian=True)
    principal = np.linalg.eigvalsh(0.5 * (W + W.swapaxes(1, 2)))
    return np.asarray(np.abs(principal).max(axis=1))


def _tangents(normals: Array) -> Array:
    """Unit vectors across unit `normals` (m, d) and each other, (m, d, d-1)."""
    # A reflection that turns the last axis to the normal; its other columns are across.
    d = normals.shape[1]
    axis = np.where(normals[:, -1:] < 0.0, 1.0, -1.0) * np.eye(d)[-1]
    mirror = normals - axis
    square = np.einsum("mi,mi->m", mirror, mirror)
    turned = np.eye(d) - 2.0 * np.einsum("mi,mj->mij", mirror, mirror) / square[:, None, None]
    return np.asarray(turned[:, :, :-1])
