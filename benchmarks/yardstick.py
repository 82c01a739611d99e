"""The yardstick as Python sees it: built where it is used, with the compiler that is there."""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from solidsph.arrays import Array
from solidsph.body import Body

_SOURCE = Path(__file__).with_name("yardstick.c")
_FLAGS = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]


def yardstick(body: Body) -> Callable[[Array, int], Array]:
    """Forces (n, 3) [N] of a neo-Hookean body from displacements (n, 3) [m] and a thread count."""
    library = _library()
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
        library.omp_set_num_threads(threads)
        library.forces(
            ctypes.c_int64(n),
            *(_pointer(array) for array in (starts, columns, plain, volumes, corrections)),
            ctypes.c_double(lam),
            ctypes.c_double(mu),
            *(_pointer(array) for array in (displacements, work, out)),
        )
        return out

    return forces


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def _library() -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "yardstick.so"
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, *_FLAGS, str(_SOURCE), "-o", str(target), "-lm"], check=True)
        return ctypes.CDLL(str(target))
