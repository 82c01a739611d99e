"""The yardstick as Python sees it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from native import library, pointer

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array


def yardstick(body: Body) -> Callable[[Array, int], Array]:
    """Forces (n, 3) [N] of a neo-Hookean body from displacements (n, 3) [m] and a thread count."""
    compiled = library("yardstick.c")
    pairs, volumes = body.pairs(), body.particles.volumes
    plain = body.smoothing.gradient(pairs.offsets, pairs.distances) * volumes[pairs.columns, None]
    moments = pairs.row_sums(pairs.offsets[:, :, None] * plain[:, None, :])
    corrections = np.ascontiguousarray(np.linalg.inv(moments).transpose(0, 2, 1))
    # Only pairs that act: of the particle itself, and of those just outside, the weight is zero.
    acts = (plain != 0.0).any(axis=1)
    starts = np.concatenate([[0], np.cumsum(np.bincount(pairs.rows[acts], minlength=len(volumes)))])
    columns = pairs.columns[acts].astype(np.int32)
    plain = plain[acts]
    n = len(volumes)
    work, out = np.empty((n, 3, 3)), np.empty((n, 3))
    lam, mu = body.material.lame_parameters

    def forces(displacements: Array, threads: int) -> Array:
        compiled.omp_set_num_threads(threads)
        compiled.forces(
            ctypes.c_int64(n),
            *(pointer(array) for array in (starts, columns, plain, volumes, corrections)),
            ctypes.c_double(lam),
            ctypes.c_double(mu),
            *(pointer(array) for array in (displacements, work, out)),
        )
        return out

    return forces
