"""Edges of a body in space: points of them in the order in which they follow each other."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.discretisations._features import Features

# Points follow each other along an edge up to this distance, and lead to a corner, in gaps between
# samples of the surface.
_NEXT = 3.0
# So far from a corner, points of its edges that are no further from each other than that are seen
# from each other at more than this angle to their edges.
_AROUND = 2.0
_ALONG = 0.8  # its cosine

# Beside an edge, so many spacings along each of its faces, the boundary is that face alone.
_BESIDE = 1e-3
# How often a point between two of an edge is moved onto its faces: twice, the second for rounding.
_MOVED = 2


@attrs.frozen(eq=False)
class Line:
    """Points that follow each other, (m, d) [m]: from one end to the other, or round."""

    points: Array
    closed: bool


def lines(of: Features, corners: Array, reach: float) -> Iterator[Line]:
    """The edges through points `of` them, which end at `corners` (k, d) [m] or run round.

    `reach` [m] is the largest gap between samples of the surface. A tree of the shortest ways joins
    the points of each edge; its longest path is the edge.
    """
    tree = cKDTree(corners) if len(corners) else None
    if tree is not None:
        some = tree.query(of.points)[0] > _AROUND * reach
        of = Features(of.points[some], of.normals[some])
    for path in _paths(of, _NEXT * reach):
        line = of.points[path]
        closed = len(path) > 3 and bool(np.linalg.norm(line[-1] - line[0]) < _NEXT * reach)
        if tree is not None:
            gaps, nearest = tree.query(line[[0, -1]])
            first, last = (
                corners[[corner]] if gap < _NEXT * reach else line[:0]
                for gap, corner in zip(
                    np.asarray(gaps).tolist(), np.asarray(nearest).tolist(), strict=True
                )
            )
            closed &= not len(first) and not len(last)
            line = np.concatenate([first, line, last])
        yield Line(np.concatenate([line, line[:1]]) if closed else line, closed)


def _paths(of: Features, distance: float) -> Iterator[Indices]:
    """Numbers of the points along each edge: neighbours are less than a `distance` [m] apart."""
    points = of.points
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    offsets = points[pairs[:, 1]] - points[pairs[:, 0]]
    lengths = np.linalg.norm(offsets, axis=1)
    follows = np.ones(len(pairs), dtype=np.bool_)
    for end in pairs.T:
        along = Features(points[end], of.normals[end]).along(offsets)
        follows &= np.linalg.norm(along, axis=1) >= _ALONG * lengths
    pairs, lengths = pairs[follows], lengths[follows]
    shape = (len(points), len(points))
    # A link without length would be none.
    graph = coo_array((np.maximum(lengths, 1e-9 * distance), tuple(pairs.T)), shape=shape)
    tree = minimum_spanning_tree(graph.tocsr())
    links, names = csr_array(tree + tree.T), np.arange(len(points))
    while len(names):
        labels = connected_components(links, directed=False)[1]
        rest = np.ones(len(names), dtype=np.bool_)
        for start in np.unique(labels, return_index=True)[1].tolist():
            # What is reached last is one end, and from there the other.
            end = breadth_first_order(links, start, directed=False)[0][-1]
            found, before = breadth_first_order(links, end, directed=False)
            path = [int(found[-1])]
            while path[-1] != end:
                path.append(int(before[path[-1]]))
            rest[path] = False
            yield names[path]
        # Branches off a path are edges of their own.
        links, names = csr_array(links[rest][:, rest]), names[rest]


def onto_edges(shape: Shape, of: Features, points: Array, spacing: float) -> Array:
    """`points` (m, 3) beside edges `of` a shape, moved onto both faces, (m, 3) [m].

    Between two points of a curved edge the straight line leaves it. How far a face is away is told
    by the distance a little along it, on the side of the edge where the face is.
    """
    if not len(points):
        return points
    normals = of.normals[cKDTree(of.points).query(points)[1]]
    inverse = np.linalg.pinv(normals)
    cosines = np.einsum("mi,mi->m", normals[:, 0], normals[:, 1])
    across = normals[:, ::-1] - cosines[:, None, None] * normals
    across *= _BESIDE * spacing / np.linalg.norm(across, axis=2, keepdims=True)
    for _ in range(_MOVED):
        heights = np.empty(normals.shape[:2])
        for face in range(2):
            sides = np.stack(
                [shape.signed_distance(points + way * across[:, face]) for way in (-1.0, 1.0)]
            )
            there = np.argmin(np.abs(sides), axis=0)
            heights[:, face] = np.take_along_axis(sides, there[None], axis=0)[0]
        points = points - np.einsum("mik,mk->mi", inverse, heights)
    return points
