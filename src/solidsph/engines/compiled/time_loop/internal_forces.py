"""Internal forces in the compiled loop: one call for all bodies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.rows import Rows
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.engines.compiled.time_loop.call_each import call_each
from solidsph.engines.compiled.time_loop.constraints import following
from solidsph.engines.compiled.time_loop.filtered import filtered_data, filtered_forces
from solidsph.engines.compiled.time_loop.merged import MergedLoad
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import LinearExtension
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Indices

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody


class BodyData(NamedTuple):
    """The arrays of one body; those from `force_table` on serve two separate passes."""

    extent: tuple[int, int]  # its first particle and the end of its particles
    table: Indices  # partition of the gathering pass
    rows: Rows
    u: NDArray[Any]  # flat
    params: tuple[float, ...]
    factors: NDArray[Any]
    buffers: NDArray[Any]  # of the scattering pass
    force_table: Indices  # partition of the scattering pass
    force_rows: Rows
    stress: Array  # (d, d, n)
    ghosts: Indices  # (g,)
    history: Array  # (n, k) internal variables; k is 0 for a material without
    step: float  # by which they advance [s]


class Internal(NamedTuple):
    """Compiled internal forces, and their data."""

    forces: Any  # (data, u (n, d), v (n, d), total (n, d)): total = internal forces of all bodies
    data: Any
    histories: Sequence[tuple[Body, Array]] = ()  # of bodies that have some, in the data


def internal_forces(
    parts: Sequence[ReferenceBody],
    conditions: Sequence[StressTerm],
    step: float,
    merged: MergedLoad | None = None,
) -> Internal:
    """The internal forces of prepared bodies under these conditions, in steps of `step` [s], with
    those of a `merged` load.

    Raises:
        NotCompilableError: a condition is not of a compilable kind, or there are several bodies.
    """
    if all(part.fused for part in parts) and not conditions:
        if merged is None:
            functions = tuple(map(_function, parts))
            data: tuple[Any, ...] = tuple(
                filtered_data(part, step) if part.filters else _data(part, step, staged=False)
                for part in parts
            )
        else:
            functions, data = merged.functions, merged.data
        histories = [
            (part.body, one.history)
            for part, one in zip(parts, data, strict=True)
            if part.remembers
        ]
        return Internal(call_each(functions), data, histories)
    if len(parts) > 1:
        raise NotCompilableError("conditions on the stress of several bodies")
    (part,) = parts
    for condition in conditions:
        if not isinstance(condition, LinearExtension):
            raise NotCompilableError(f"condition {condition.label!r} is not of a compilable kind")
    d = part.body.particles.dimension
    imposed = call_each(tuple(_stress_following(d) for _ in conditions))
    acts = part.body.formulation.divergence.uses_ghost_stress
    forces = _staged(part.stress_pass, imposed, part.spread_pass, acts)
    extensions = [c for c in conditions if isinstance(c, LinearExtension)]
    return Internal(
        forces, (_data(part, step, staged=True), tuple(following(c, c.stress) for c in extensions))
    )


def _function(part: ReferenceBody) -> Any:
    return filtered_forces(part) if part.filters else _fused(part.force_pass)


@cache
def _fused(forces: Any) -> Any:
    @njit
    def fused(body, u, v, total):
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
            body.history,
            body.step,
        )

    return fused


@cache
def _staged(stress_pass: Any, imposed: Any, spread: Any, ghosts_act: bool) -> Any:
    @njit
    def forces(data, u, v, total):
        body, followed = data
        stress_pass(body.table, body.rows, u, body.u, body.params, body.stress)
        for p in body.ghosts:
            body.stress[:, :, p] = 0.0
        imposed(followed, body.stress)
        if not ghosts_act:  # a constant of the compilation
            for p in body.ghosts:
                body.stress[:, :, p] = 0.0
        spread(body.force_table, body.force_rows, body.stress, body.factors, body.buffers, total)
        if ghosts_act:
            # Ghosts have acted through their stress; no force acts on them.
            for p in body.ghosts:
                total[p] = 0.0

    return forces


def _data(part: ReferenceBody, step: float, *, staged: bool) -> BodyData:
    extent, ghosts = part.body.extent, part.body.particles.ghosts
    n, d = part.body.particles.positions.shape
    return BodyData(
        extent=(extent.start, extent.stop),
        table=part.gradient_partition.table,
        rows=part.gradient,
        u=part.u,
        params=part.body.material.params,
        factors=part.factors,
        buffers=part.force_partition.buffers,
        force_table=part.force_partition.table,
        force_rows=part.force,
        stress=np.zeros((d, d, n if staged else 0)),
        ghosts=np.flatnonzero(ghosts),
        history=part.history(),
        step=step,
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
