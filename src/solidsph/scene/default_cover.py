"""Cover: how many particle spacings the support radius of a kernel is.

On a lattice the gradient does not see a saw-tooth, in which neighbours in a row move by equal and
opposite amounts. Only where its amplitude varies is there a force against it, and the wider the
kernel the weaker that force is. At a cover that suits one kernel another one is blind, so the
default is derived from the kernel.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import check_profile, profile_slope
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct
from solidsph.scene.scene_data import SceneData

# The default is the largest tenth at which a bar is held at least so well. The figure is that of
# 3.5 spacings of the paper's own kernel, less rounding; it makes 2.6 of the cubic spline.
_HELD = 0.475

BLIND = 0.45
"""Below this, neighbours in a row that is pulled at rest are off by more than the strain itself
(tests/scene/test_default_cover.py): the share of `held`."""

_COVERS = np.arange(12, 61) / 10.0

# Where no cover holds a row, as with a profile that is none, which the build will tell.
_USUAL = 3.5

_WAVES = 200


def cover_of(scene: SceneData) -> float:
    """The cover that the scene names, or else its kernel's own [spacings].

    Raises:
        SceneError, PluginError: the kernel cannot be made, or its profile is not a weight.
    """
    return own_cover(construct("kernels", scene.kernel)) if scene.cover is None else scene.cover


def own_cover(kernel: Kernel) -> float:
    """The largest cover at which the gradient holds neighbours in a row [spacings].

    Raises:
        PluginError: the profile is not a weight.
    """
    check_profile(kernel)
    enough = [cover for cover in _COVERS if held(kernel, 1, cover) >= _HELD]
    return float(max(enough, default=_USUAL))


def held(kernel: Kernel, dimension: int, cover: float) -> float:
    """How well the gradient holds waves along the rows of a lattice, at worst.

    A wave of k per spacing appears to the gradient as one of kappa(k); its frequency is that of
    kappa. Next to the saw-tooth, k = pi, kappa is in proportion to pi - k, which is the wave number
    of its amplitude. The result is the least of kappa over k, or over pi - k if that is less:
    2 / pi if only the next neighbours act, below 0 if kappa changes its sign in between.
    """
    places = _places(dimension, int(np.ceil(cover)))
    distances = np.linalg.norm(places, axis=1)
    places, distances = places[distances < cover], distances[distances < cover]
    along = places[:, 0]
    # Weights along the row of the linearly corrected gradient, whose sum of g x is 1; not finite
    # where no neighbour has any weight.
    with np.errstate(all="ignore"):
        slopes = profile_slope(kernel, distances / cover) / distances
        weights = slopes * along / np.sum(slopes * along**2)
    k = np.pi * np.arange(1, _WAVES) / _WAVES
    kappa = np.sin(np.outer(k, along)) @ weights
    worst = float(np.min(kappa / np.minimum(k, np.pi - k)))
    return worst if np.isfinite(worst) else 0.0


@cache
def _places(dimension: int, reach: int) -> Array:
    """The other points of a lattice up to so many spacings away along each axis, (m, d)."""
    lattice = np.array(list(product(range(-reach, reach + 1), repeat=dimension)), dtype=float)
    return lattice[np.any(lattice != 0.0, axis=1)]
