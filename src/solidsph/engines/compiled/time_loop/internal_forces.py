"""Internal forces within the compiled loop: one call for all bodies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.engines.compiled.reference.rows import Rows
from solidsph.engines.compiled.time_loop.call_each import call_each
from solidsph.interfaces.compilable_terms import LinearExtension
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Indices

if TYPE_CHECKING:
    from solidsph.engines.compiled.reference.body import ReferenceBody


class Fused(NamedTuple):
    """A body whose stress goes from one pass to the other at once."""

    extent: tuple[int, int]  # its first particle, and the one after the last
    table: Indices
    rows: Rows
    u: NDArray[Any]  # flat
    params: tuple[float, ...]
    factors: NDArray[Any]
    buffers: NDArray[Any]


class Staged(NamedTuple):
    """A body whose stress is seen by conditions in between."""

    table: Indices  # of the gathering pass
    rows: Rows
    u: NDArray[Any]  # flat
    params: tuple[float, ...]
    force_table: Indices  # of the scattering pass
    force_rows: Rows
    factors: NDArray[Any]
    buffers: NDArray[Any]
    stress: Array  # (d, d, n) its own
    ghosts: Indices  # (g,)


class StressFollowing(NamedTuple):
    """Ghosts whose stress follows that of others."""

    ghosts: Indices  # (k,)
    signs: Array  # (k, d)
    starts: NDArray[np.int32]
    columns: NDArray[np.int32]
    weights: Array


class Internal(NamedTuple):
    """Compiled internal forces, and the data that they take."""

    forces: Any  # (data, u (n, d), total (n, d)): total = internal forces of all bodies
    data: Any


def internal_forces(parts: Sequence[ReferenceBody], conditions: Sequence[StressTerm]) -> Internal:
    """The internal forces of prepared bodies under these conditions.

    Raises:
        NotCompilableError: a condition is not of a declared kind, or sees several bodies.
    """
    if all(part.fused for part in parts) and not conditions:
        functions = tuple(_fused(part.passes.forces) for part in parts)
        return Internal(call_each(functions), tuple(_fused_data(part) for part in parts))
    if len(parts) > 1:
        raise NotCompilableError("conditions on the stress of several bodies")
    (part,) = parts
    for condition in conditions:
        if not isinstance(condition, LinearExtension):
            raise NotCompilableError(f"condition {condition.label!r} is not of a declared kind")
    d = part.body.particles.dimension
    imposed = call_each(tuple(_stress_following(d) for _ in conditions))
    acts = part.body.formulation.divergence.uses_ghost_stress
    forces = _staged(part.passes.stress, imposed, part.spread_pass, acts)
    followed = tuple(_followed(c) for c in conditions if isinstance(c, LinearExtension))
    return Internal(forces, (_staged_data(part), followed))


@cache
def _fused(forces: Any) -> Any:
    @njit
    def fused(body, u, total):
        a, b = body.extent
        forces(
            body.table,
            body.rows,
            u[a:b],
            body.u,
            body.params,
            body.factors,
            body.buffers,
            total[a:b],
        )

    return fused


def _fused_data(part: ReferenceBody) -> Fused:
    extent, shares = part.body.extent, part.gradient_partition
    return Fused(
        extent=(extent.start, extent.stop),
        table=shares.table,
        rows=part.gradient,
        u=part.u,
        params=part.body.material.params,
        factors=part.factors,
        buffers=shares.buffers,
    )


@cache
def _staged(stress_pass: Any, imposed: Any, spread: Any, ghosts_act: bool) -> Any:
    @njit
    def forces(data, u, total):
        body, followed = data
        stress_pass(body.table, body.rows, u, body.u, body.params, body.stress)
        for p in body.ghosts:
            body.stress[:, :, p] = 0.0
        imposed(followed, body.stress)
        if not ghosts_act:  # known when this compiles
            for p in body.ghosts:
                body.stress[:, :, p] = 0.0
        spread(body.force_table, body.force_rows, body.stress, body.factors, body.buffers, total)
        if ghosts_act:
            # Ghosts have acted through their stress; nothing acts on them.
            for p in body.ghosts:
                total[p] = 0.0

    return forces


def _staged_data(part: ReferenceBody) -> Staged:
    d = part.body.particles.dimension
    return Staged(
        table=part.gradient_partition.table,
        rows=part.gradient,
        u=part.u,
        params=part.body.material.params,
        force_table=part.force_partition.table,
        force_rows=part.force,
        factors=part.factors,
        buffers=part.force_partition.buffers,
        stress=np.zeros((d, d, part.body.particles.count)),
        ghosts=np.flatnonzero(part.body.particles.ghosts),
    )


@cache
def _stress_following(dimension: int) -> Any:
    @njit
    def impose(following, stress):
        for k in range(len(following.ghosts)):
            for i in range(dimension):
                for j in range(dimension):
                    total = 0.0
                    for m in range(following.starts[k], following.starts[k + 1]):
                        total += following.weights[m] * stress[i, j, following.columns[m]]
                    sign = following.signs[k, i] * following.signs[k, j]
                    stress[i, j, following.ghosts[k]] = sign * total

    return impose


def _followed(condition: LinearExtension) -> StressFollowing:
    B = condition.stress
    return StressFollowing(condition.ghosts, condition.signs, B.indptr, B.indices, B.data)
