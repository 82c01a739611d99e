"""Edges and corners of a boundary, found from samples of it."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Surface
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.discretisations._nearest import thinned

# Tangent planes at more than this angle make an edge; at less, a bend.
_SHARPEST_BEND = np.cos(np.radians(30.0))
# Pairs of normals that differ by less are skipped.
_SMOOTH = 0.2
# Singular values of the normals below this part of the largest are rounding.
_DEPENDENT = 1e-6
# Samples are neighbours up to so many gaps between samples.
_NEIGHBOURS = 2.0


@attrs.frozen(eq=False)
class Features:
    """Points that lie on several tangent planes of the boundary at once."""

    points: Array  # (m, d) [m]
    normals: Array  # (m, k, d) of the planes through each point, not all independent [-]

    def along(self, offsets: Array) -> Array:
        """The part of `offsets` (m, d), one from each point, along all its planes, (m, d)."""
        inverse = np.linalg.pinv(self.normals, rcond=_DEPENDENT)
        part: Array = offsets - np.einsum("mik,mkj,mj->mi", inverse, self.normals, offsets)
        return part


def gap(surface: Surface) -> float:
    """Largest distance between neighbouring samples [m]."""
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    return float(sizes.max() ** (1.0 / max(surface.points.shape[1] - 1, 1)))


def smooth(surface: Surface) -> Features:
    """The samples themselves, with one tangent plane each."""
    normals = surface.area_vectors / np.linalg.norm(surface.area_vectors, axis=1, keepdims=True)
    return Features(surface.points, normals[:, None, :])


def meetings(of: Features, reach: float) -> Features:
    """Intersections of the planes of neighbouring features: edges of faces, corners of edges.

    Each point is that on all planes of two neighbours which is nearest to the middle between them;
    `reach` [m] is the distance of neighbours. Of several points at the same place, the one whose
    neighbours are closest to each other is kept.
    """
    d = of.points.shape[1]
    some = _beside_bends(of, _NEIGHBOURS * reach)
    tree = cKDTree(of.points[some])
    pairs = some[tree.query_pairs(_NEIGHBOURS * reach, output_type="ndarray")]
    # Nearly all neighbours lie on the same smooth part.
    bent = np.abs(of.normals[pairs[:, 1]] - of.normals[pairs[:, 0]]).max(axis=(1, 2), initial=0.0)
    pairs = np.sort(pairs[bent > _SMOOTH], axis=1)
    normals = of.normals[pairs].reshape(len(pairs), 2 * of.normals.shape[1], d)
    crossing = _rank(normals) > _rank(of.normals[pairs]).max(axis=1, initial=0)
    pairs, normals = pairs[crossing], normals[crossing]
    ends = of.points[pairs]
    middle = ends.mean(axis=1)
    heights = np.einsum("mskj,msj->msk", of.normals[pairs], ends - middle[:, None])
    inverse = np.linalg.pinv(normals, rcond=_DEPENDENT)
    way = np.einsum("mik,mk->mi", inverse, heights.reshape(normals.shape[:2]))
    apart = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    order = np.lexsort((pairs[:, 1], pairs[:, 0], np.round(apart / reach, 6)))
    order = order[np.linalg.norm(way[order], axis=1) <= _NEIGHBOURS * reach]
    points = (middle + way)[order]
    if not len(points):
        return Features(points, normals[order])
    stays = thinned(points, np.arange(len(points)), 0.5 * reach)
    return Features(points[stays], normals[order][stays])


def _beside_bends(of: Features, distance: float) -> Indices:
    """Features with all those whose neighbours, up to this `distance` [m], have other normals.

    Of most features in cubes that are at least as large, the cubes around included, the normals
    are alike: they lie deep in a smooth face.
    """
    m, d = of.points.shape
    if not m:
        return np.arange(0)
    offsets = of.points - of.points.min(axis=0)
    extent = offsets.max(axis=0)
    side = max(distance, float(np.prod(extent) / m) ** (1.0 / d))
    counts = tuple((extent // side).astype(np.intp) + 1)
    cubes = np.ravel_multi_index(tuple((offsets // side).astype(np.intp).T), counts)
    order = np.argsort(cubes, kind="stable")
    there, first = np.unique(cubes[order], return_index=True)
    bent = np.zeros(counts, dtype=np.bool_)
    for normal in of.normals.reshape(m, -1)[order].T:
        least, most = np.full(counts, np.inf), np.full(counts, -np.inf)
        least.flat[there] = np.minimum.reduceat(normal, first)
        most.flat[there] = np.maximum.reduceat(normal, first)
        bent |= maximum_filter(most, 3) - minimum_filter(least, 3) > _SMOOTH
    return np.flatnonzero(bent.ravel()[cubes])


def _rank(normals: Array) -> Array:
    """Number of planes with these `normals` (..., k, d) that cross sharply, (...)."""
    # The singular values of two unit normals at an angle a are sqrt(1 +- cos a).
    sharp = np.sqrt(1.0 - _SHARPEST_BEND)
    return np.asarray(np.sum(np.linalg.svd(normals, compute_uv=False) > sharp, axis=-1))
