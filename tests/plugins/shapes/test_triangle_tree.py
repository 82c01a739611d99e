"""Closest places on triangles against all triangles one by one."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh

from solidsph_builtin.shapes._triangle_tree import closest, tree_of
from solidsph_builtin.shapes._triangles import area_vectors
from tests.helpers.mesh_bodies import hollow_box


def normals_of(corners: np.ndarray) -> np.ndarray:
    areas = area_vectors(corners)
    sizes = np.linalg.norm(areas, axis=1, keepdims=True)
    return areas / np.where(sizes > 0.0, sizes, 1.0)


@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(trimesh.creation.icosphere(2), id="sphere"),
        pytest.param(hollow_box(), id="hollow box"),
        pytest.param(trimesh.creation.cylinder(0.02, 2.0, sections=7), id="needles"),
    ],
)
def test_closest_places_are_those_of_libigl(mesh: trimesh.Trimesh) -> None:
    corners = np.asarray(mesh.vertices)[mesh.faces]
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (700, 3))
    triangles, feet = closest(tree_of(corners, normals_of(corners)), points, np.inf)
    squares, _, _ = igl.point_mesh_squared_distance(points, np.asarray(mesh.vertices), mesh.faces)
    assert np.linalg.norm(feet - points, axis=1) == pytest.approx(np.sqrt(squares), abs=1e-14)
    # Each place is on the triangle that comes with it.
    offsets = np.einsum("ni,ni->n", feet - corners[triangles, 0], normals_of(corners)[triangles])
    assert np.abs(offsets).max() < 1e-14


def test_beyond_the_reach_there_is_none() -> None:
    corners = np.asarray(trimesh.creation.icosphere(3).triangles)
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.9], [0.0, 0.0, 1.5]])
    triangles, feet = closest(tree_of(corners, normals_of(corners)), points, 0.2)
    assert (triangles >= 0).tolist() == [False, True, False]
    assert np.array_equal(feet[[0, 2]], points[[0, 2]])
