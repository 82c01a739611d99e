"""Functions of a coarse grid that have no stiffness there, but move what the body holds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph.maths.arrays import Array, Mask
from solidsph.statics.coarse_space import CoarseSpace
from solidsph.statics.factors import Factors, SingularError, factorise

# The stiffness that they are given, as a part of the diagonal.
_STIFFNESS = 1e-4

# What moves with less than this has none: rounding leaves 1e-16. Three particles alone in a cell at
# the surface of an elbow turned on the grid for nothing, and in the body for 6e-6.
_NONE = 1e-9


def held_in_body(
    space: CoarseSpace,
    pattern: int,
    matrix: csr_array,
    free: Mask,
    product: Callable[[Array], Array],
) -> Factors | None:
    """Factors of a singular `matrix` (k, k) with a small stiffness added; None if the softest
    motion has none in the body either.

    A particle alone in a cell turns freely on the grid, while neighbours hold it in the body.

    Args:
        space: of the functions.
        pattern: theirs.
        matrix: their stiffness.
        free: the free displacements, (n, d).
        product: of the body's tangent with motions (n, d).
    """
    diagonal = np.abs(matrix.diagonal())
    try:
        softened, factors = (
            factorise(csr_array(matrix + diags_array(part * diagonal)), symmetric=True)
            for part in (_NONE, _STIFFNESS)
        )
    except SingularError:
        return None
    forces = np.sqrt(diagonal) * np.random.default_rng(0).standard_normal(len(diagonal))
    softest = softened.solve(forces)
    motion = np.where(free, (space.matrix(pattern) @ softest).reshape(free.shape), 0.0)
    energy = float(np.vdot(motion, product(motion)))
    return factors if energy > _NONE * float(softest @ (diagonal * softest)) else None
