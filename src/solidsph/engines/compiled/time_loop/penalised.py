"""Internal forces with those of the hourglass energy, which share their passes.

One sweep gathers H for both, near pairs give forces and stresses, and one sweep scatters the stress
of the material with theirs.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.penalty_sweep import added_stress_pass
from solidsph.engines.compiled.fixed.rows import Rows
from solidsph.engines.compiled.history_law import history_count, particle_stress
from solidsph.engines.compiled.hourglass_pairs import NearPairs, near_pass
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.planes import adding, filling
from solidsph.interfaces.hourglass_energy import HourglassPairs
from solidsph.maths.arrays import Array, Indices

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody


class PenalisedBody(NamedTuple):
    """The arrays of one body."""

    extent: tuple[int, int]  # its first particle and the end of its particles
    table: Indices  # partition among threads
    rows: Rows
    u: NDArray[Any]  # flat
    params: tuple[float, ...]
    factors: Array
    buffers: Array
    history: Array  # (n, k) internal variables; k is 0 for a material without
    step: float  # by which they advance [s]
    near: NearPairs
    gradients: Array  # H among the jets of near pairs, (d, d, n and more)
    stresses: Array  # S among their pulls, (d, d, n and more)


def penalised_data(part: ReferenceBody, near: HourglassPairs, step: float) -> PenalisedBody:
    """The arrays of a body and its near pairs, in steps of `step` [s]."""
    own, extent = part.gradient_partition, part.body.extent
    pairs = NearPairs.of(near, len(own.table))
    return PenalisedBody(
        extent=(extent.start, extent.stop),
        table=own.table,
        rows=part.gradient,
        u=part.u,
        params=part.body.material.params,
        factors=part.factors,
        buffers=own.buffers,
        history=np.zeros((part.body.particles.count, history_count(part.body))),
        step=step,
        near=pairs,
        gradients=pairs.tensors(pairs.jets),
        stresses=pairs.tensors(pairs.pulls),
    )


def penalised_forces(part: ReferenceBody) -> Any:
    """Compiled (data, u (n, d), v (n, d), total (n, d)) that sets the forces of one body."""
    stress_at = particle_stress(part.body, part.law)
    dimension, threaded = part.body.smoothing.dimension, part.gradient_partition.threaded
    return _forces(dimension, part.gradients.stress, stress_at, threaded)


@cache
def _forces(dimension: int, gather: Any, stress_at: Any, threaded: bool) -> Any:
    d = dimension
    pull, scatter = near_pass(d, threaded), added_stress_pass(d, stress_at, threaded)

    fill, add = filling(d, threaded), adding(d, threaded)

    @njit
    def forces(body, u, v, total):
        a, b = body.extent
        near, threads, stride = body.near, len(body.table), body.gradients.shape[2]
        gather(body.table, body.rows, u[a:b], body.u, (0.0,), body.gradients)
        fill(threads, u[a:b], near.jets, stride)
        pull(near.shares, near.pairs, near.jets, near.sums, near.pulls)
        scatter(
            body.table,
            body.rows,
            body.gradients,
            body.stresses,
            body.params,
            body.history,
            body.step,
            body.factors,
            body.buffers,
            total[a:b],
        )
        add(threads, near.pulls, stride, total[a:b])

    return forces
