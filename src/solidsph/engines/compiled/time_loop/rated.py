"""Internal forces with those of a stress by the rate, which share their passes."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.rated_pass import rated_pass
from solidsph.engines.compiled.fixed.rows import Rows
from solidsph.engines.compiled.history_law import history_count, particle_stress
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import compiled_rate_flux
from solidsph.interfaces.compilable_terms import RateStressLoad
from solidsph.maths.arrays import Array, Indices

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody


class RatedBody(NamedTuple):
    """The arrays of one body."""

    extent: tuple[int, int]  # its first particle and the end of its particles
    table: Indices  # partition among threads
    rows: Rows
    u: NDArray[Any]  # flat
    v: NDArray[Any]  # flat
    params: tuple[float, ...]
    rate_params: tuple[float, ...]
    factors: NDArray[Any]
    buffers: NDArray[Any]
    history: Array  # (n, k) internal variables; k is 0 for a material without
    step: float  # by which they advance [s]
    stress: Array  # by the rate, at the last step, (d, d, n)
    gradients: Array  # H at the last step, (d, d, n)
    works: Array  # of this stress, by thread [J]


def rated_data(part: ReferenceBody, load: RateStressLoad, step: float) -> RatedBody:
    """The arrays of a body for this load, in steps of `step` [s]."""
    own, extent = part.gradient_partition, part.body.extent
    n, d = part.body.particles.positions.shape
    return RatedBody(
        extent=(extent.start, extent.stop),
        table=own.table,
        rows=part.gradient,
        u=part.u,
        v=np.zeros_like(part.u),
        params=part.body.material.params,
        rate_params=load.params_of(part.body),
        factors=part.factors,
        buffers=own.buffers,
        history=np.zeros((n, history_count(part.body))),
        step=step,
        stress=np.zeros((d, d, n)),
        gradients=np.zeros((d, d, n)),
        works=np.zeros(len(own.table)),
    )


def rated_forces(part: ReferenceBody, load: RateStressLoad) -> Any:
    """Compiled (data, u (n, d), v (n, d), total (n, d)) that sets the forces of one body.

    Raises:
        NotCompilableError: the stress does not compile.
    """
    d, count = part.body.smoothing.dimension, len(load.params_of(part.body))
    rate_law = compiled_rate_flux(part.body.formulation, load.stress, d, count)
    stress_at = particle_stress(part.body, part.law)
    threaded = part.gradient_partition.threaded
    return _forces(rated_pass(d, part.u.dtype.name, stress_at, rate_law, threaded))


@cache
def _forces(run: Any) -> Any:
    @njit
    def forces(body, u, v, total):
        a, b = body.extent
        run(
            body.table,
            body.rows,
            u[a:b],
            v[a:b],
            body.u,
            body.v,
            body.params,
            body.history,
            body.step,
            body.rate_params,
            body.stress,
            body.gradients,
            body.factors,
            body.buffers,
            total[a:b],
            body.works,
        )

    return forces
