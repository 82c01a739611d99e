"""Triangles that cross each other or lie on each other, against independent methods."""

from __future__ import annotations

from itertools import pairwise

import igl
import numpy as np
import pytest
import trimesh

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._mesh_crossings import first_meetings
from solidsph_builtin.shapes.mesh import Mesh
from tests.helpers.mesh_bodies import BODIES


def meetings(*triangles: Array) -> tuple[bool, bool]:
    """Whether triangles cross, and overlap; corners in one place are one."""
    points, corners = np.unique(np.concatenate(triangles), axis=0, return_inverse=True)
    found = first_meetings(points, corners.reshape(-1, 3))
    return found.crossing is not None, found.overlap is not None


def common_area(one: Array, other: Array) -> float:
    """Of two triangles (3, 2) in a plane, one cut by the edges of the other."""
    polygon = list(one)
    if np.linalg.det(np.diff(other, axis=0)) < 0.0:
        other = other[::-1]
    for a, b in pairwise([*other, other[0]]):
        side = [float(np.linalg.det([b - a, p - a])) for p in polygon]
        cut = []
        for k, (p, h) in enumerate(zip(polygon, side, strict=True)):
            q, g = polygon[k - 1], side[k - 1]
            if (h < 0.0) != (g < 0.0):
                cut.append(q + g / (g - h) * (p - q))
            if h >= 0.0:
                cut.append(p)
        polygon = cut
    x, y = np.array(polygon).T if polygon else np.zeros((2, 1))
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


TURN = trimesh.transformations.euler_matrix(0.3, 0.6, 0.1)[:3, :3]


def test_triangles_in_one_plane_overlap_where_they_have_area_in_common() -> None:
    random = np.random.default_rng(3)
    seen = {True: 0, False: 0}
    for _ in range(400):
        plane = random.uniform(-1.0, 1.0, (2, 3, 2))
        area = common_area(*plane)
        turned = [np.column_stack([t, np.zeros(3)]) @ TURN.T + 5.0 for t in plane]
        if not 0.0 < area < 1e-6:  # less is neither
            assert meetings(*turned) == (False, area > 0.0)
            seen[area > 0.0] += 1
    assert min(seen.values()) > 50


def test_triangles_in_space_cross_where_another_library_says_so() -> None:
    random = np.random.default_rng(4)
    seen = {True: 0, False: 0}
    for _ in range(400):
        one, other = random.uniform(-1.0, 1.0, (2, 3, 3))
        expected = bool(igl.tri_tri_overlap_test_3d(*(p[None] for p in (*one, *other))))
        assert meetings(one, other) == (expected, False)
        seen[expected] += 1
    assert min(seen.values()) > 50


A, B, C, D = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0]])


@pytest.mark.parametrize(
    ("others", "overlap"),
    [
        ([[B, D, C]], False),  # along an edge
        ([[B, C, np.array([0.5, 0.5, 0.0])]], True),  # the same, folded back
        ([[B, C, np.array([0.5, 0.5, 1.0])]], False),  # folded half way
        ([[np.array([0.5, 0, 0]), np.array([1.5, 0, 0]), np.array([1.0, -1, 0])]], False),
        ([[np.array([0.5, 0, 0]), np.array([1.5, 0, 0]), np.array([1.0, 0.5, 0])]], True),
        ([[np.array([0.4, 0.4, 0]), np.array([0.6, 0.4, 0]), np.array([0.5, 0.5, 0])]], True),
        ([[A, np.array([-1.0, 0, 0]), np.array([0, -1.0, 0])]], False),  # at a corner
        ([[A, np.array([1.0, -1, 0]), np.array([1.0, 1.5, 0])]], True),
    ],
)
def test_what_touches_does_not_overlap(others: list[list[Array]], overlap: bool) -> None:
    triangles = [np.array([A, B, C]), *map(np.array, others)]
    assert meetings(*triangles) == (False, overlap)
    assert meetings(*triangles[::-1]) == (False, overlap)
    # A tiny one beside a large one is found as well.
    far = np.array([[1e4, 0, 50.0], [-1e4, 1e4, 50.0], [-1e4, -1e4, 50.0]])
    assert meetings(*triangles, far) == (False, overlap)


def test_bodies_whose_faces_lie_on_each_other_in_part_are_refused() -> None:
    one, two = trimesh.creation.box([1.0, 1.0, 1.0]), trimesh.creation.box([1.0, 0.2, 0.2])
    two.apply_translation([1.0, 0.3, 0.0])  # inside of a triangle, away from its middle
    both = trimesh.util.concatenate([one, two])
    with pytest.raises(SceneError, match=r"lie on each other at \(0\.5, .* the shape 'union'"):
        Mesh(vertices=both.vertices, triangles=both.faces)


@pytest.mark.parametrize("name", ["gear", "bracket", "hollow box", "fine sphere"])
def test_sound_bodies_have_no_meetings(name: str) -> None:
    mesh = BODIES[name].make()
    found = first_meetings(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    assert (found.crossing, found.overlap) == (None, None)
