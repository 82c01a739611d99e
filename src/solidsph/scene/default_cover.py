"""Default cover of a kernel, its support radius in particle spacings.

On a lattice the gradient of a saw-tooth, in which neighbours in a row move by equal and opposite
amounts, is zero. It is resisted only where its amplitude varies, and less so by a wider kernel.
The default is therefore derived from the kernel.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from itertools import product

import numpy as np

from solidsph.errors import SolidsphError
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import check_profile, profile_slope
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct
from solidsph.scene.graded_spacing import is_graded
from solidsph.scene.scene_data import SceneData
from solidsph.scene.scheme import completed

# Least wave number ratio at the default cover. This is the ratio of the paper's kernel at 3.5
# spacings, rounded down; it gives 2.6 for the cubic spline.
_LEAST_RATIO = 0.475

BLIND = 0.45
"""Wave number ratio below which neighbours in a bar under tension deviate by more than the strain
itself (tests/scene/test_default_cover.py)."""

_COVERS = np.arange(12, 61) / 10.0

# For kernels without a sufficient cover, such as wrong profiles, which the build reports.
_USUAL = 3.5

_WAVES = 200


def cover_of(scene: SceneData) -> float:
    """Cover of a scene, given or derived from its kernel [spacings].

    Raises:
        SceneError, PluginError: the kernel cannot be made, or its profile is not a weight.
    """
    scene = completed(scene)
    if scene.cover is not None:
        return scene.cover
    cover = kernel_cover(construct("kernels", scene.kernel))
    return round(cover * _share(scene), 1)


def _share(scene: SceneData) -> float:
    """The part of it that suits the gradient; 1 if a part is wrong, which the build reports."""
    with suppress(SolidsphError):
        shapes = [construct("shapes", body.shape) for body in scene.bodies.values()]
        # Where the spacing varies there is no lattice, and with the smaller cover some particles do
        # not determine a quadratic fit: an L of 485 particles balanced uniform stresses to 3e-4.
        varies = any(map(is_graded, scene.bodies.values()))
        if not varies and all(shape.dimension == 3 for shape in shapes):
            gradient = construct("formulations", scene.formulation).gradient
            return float(gradient.deep_inside.cover_in_space)
    return 1.0


def kernel_cover(kernel: Kernel) -> float:
    """Largest cover at which the gradient resists relative motion of neighbours [spacings].

    Raises:
        PluginError: the profile is not a weight.
    """
    check_profile(kernel)
    enough = [cover for cover in _COVERS if wave_number_ratio(kernel, 1, cover) >= _LEAST_RATIO]
    return float(max(enough, default=_USUAL))


def wave_number_ratio(kernel: Kernel, dimension: int, cover: float) -> float:
    """Least ratio of the effective to the actual wave number along a row of a lattice [-].

    For a wave of k per spacing the gradient has the effective wave number kappa(k). Near the
    saw-tooth, k = pi, kappa is proportional to pi - k, the wave number of its amplitude. The result
    is the minimum of kappa / min(k, pi - k): 2 / pi if only nearest neighbours act, below 0 if
    kappa changes its sign.
    """
    places = _places(dimension, int(np.ceil(cover)))
    distances = np.linalg.norm(places, axis=1)
    places, distances = places[distances < cover], distances[distances < cover]
    along = places[:, 0]
    # Linearly corrected weights g along the row, with a sum of g x of 1; not finite if no neighbour
    # has a weight.
    with np.errstate(all="ignore"):
        slopes = profile_slope(kernel, distances / cover) / distances
        weights = slopes * along / np.sum(slopes * along**2)
    k = np.pi * np.arange(1, _WAVES) / _WAVES
    kappa = np.sin(np.outer(k, along)) @ weights
    worst = float(np.min(kappa / np.minimum(k, np.pi - k)))
    return worst if np.isfinite(worst) else 0.0


@cache
def _places(dimension: int, reach: int) -> Array:
    """Points of a lattice around the origin up to `reach` spacings along each axis, (m, d)."""
    lattice = np.array(list(product(range(-reach, reach + 1), repeat=dimension)), dtype=float)
    return lattice[np.any(lattice != 0.0, axis=1)]
