"""Hypothesis strategies for the input of parts.

They need Hypothesis, which `pip install "solidsph[testing]"` brings.

Every example shrinks towards the simplest: one dimension, no rotation, F = I.
"""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from solidsph.conformance.samples import ANGLES, DIMENSIONS, deformation_gradient, rotation
from solidsph.maths.arrays import Array


def dimensions() -> st.SearchStrategy[int]:
    """1, 2 or 3."""
    return st.sampled_from(DIMENSIONS)


def support_radii(smallest: float = 1e-4, largest: float = 1e4) -> st.SearchStrategy[float]:
    """Support radii H [m]."""
    return st.floats(smallest, largest)


def rotations(dimension: int) -> st.SearchStrategy[Array]:
    """Proper rotations (d, d)."""
    angle = st.floats(-np.pi, np.pi)
    count = ANGLES[dimension]
    return st.lists(angle, min_size=count, max_size=count).map(lambda a: rotation(dimension, a))


@st.composite
def deformation_gradients(
    draw: st.DrawFn,
    dimension: int,
    *,
    volume_ratios: tuple[float, float] = (0.5, 2.0),
    distortion: float = 1.5,
) -> Array:
    """Deformation gradients F (d, d).

    Args:
        volume_ratios: least and largest J = det F [-], with 1 between them.
        distortion: largest ratio of a principal stretch to J^(1/d), except for the last stretch,
            which follows from J [-].
    """
    rounding = 1e-12  # keeps a product of rounded stretches within the bounds
    least, largest = volume_ratios
    log_J = draw(st.floats(np.log(least) + rounding, np.log(largest) - rounding))
    bound = float(np.log(distortion))
    free = draw(st.lists(st.floats(-bound, bound), min_size=dimension - 1, max_size=dimension - 1))
    stretches = np.exp(log_J / dimension + np.array([*free, -sum(free)]))
    left, right = draw(rotations(dimension)), draw(rotations(dimension))
    return deformation_gradient(stretches.tolist(), left, right)
