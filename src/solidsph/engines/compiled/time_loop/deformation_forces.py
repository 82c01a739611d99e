"""Forces by the deformation of single particles, in the compiled loop."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from scipy.sparse import csr_array

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.vectors import IDENTITY, ROW, with_outer
from solidsph.interfaces.deformation_load import DeformationLoad
from solidsph.maths.arrays import Array, Indices


class DeformationData(NamedTuple):
    """What the forces of one load need."""

    starts: Indices  # (k + 1,) first neighbour of each particle
    columns: Indices  # (m,) neighbours
    weights: Array  # (m, d) [1/m]
    values: Array  # (k, v)
    table: Array  # (t, k) its numbers for the steps to come, or (1, k) for all of them


def deformation_data(load: DeformationLoad) -> DeformationData:
    """The arrays of a load, without numbers of steps."""
    first, *others = map(abs, load.gradients)
    some = csr_array(sum(others, start=first))
    some.sort_indices()
    rows = np.repeat(np.arange(some.shape[0]), np.diff(some.indptr))
    columns = some.indices.astype(np.intp)
    weights = [csr_array(gradient)[rows, columns] for gradient in load.gradients]
    return DeformationData(
        starts=some.indptr.astype(np.intp),
        columns=columns,
        weights=np.stack([np.asarray(own).reshape(-1) for own in weights], axis=1),
        values=np.ascontiguousarray(load.values),
        table=np.zeros((1, some.shape[0])),
    )


@cache
def deformation_forces(formula: Any, dimension: int, count: int) -> Any:
    """Compiled (own, step, m, p, u, v, force), which fills the force on the particle m of a load,
    for a compiled `formula` of `count` values."""
    row, unmoved = ROW[dimension], IDENTITY[dimension]

    @njit
    def fill(own, step, m, p, u, v, force):
        F = unmoved
        for pair in range(own.starts[m], own.starts[m + 1]):
            F = with_outer(F, row(u, own.columns[pair]), row(own.weights, pair))
        number = own.table[min(step, len(own.table) - 1), m]
        found = formula(F, number, to_fixed_tuple(own.values[m], count))
        for i in range(dimension):
            force[i] = found[i]

    return fill
