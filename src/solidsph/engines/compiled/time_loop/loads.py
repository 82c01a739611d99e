"""Loads in the compiled loop: their forces and their work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import prange
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.lanes import lanes_type
from solidsph.engines.compiled.fixed.partition import rate_pass, thread_count
from solidsph.engines.compiled.fixed.rows import Rows
from solidsph.engines.compiled.hourglass_sweeps import body_sweep, compiled_sweeps
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import LANES
from solidsph.engines.compiled.pointwise import (
    NotCompilableError,
    compiled_function,
    compiled_rate_flux,
    numbers_type,
)
from solidsph.engines.compiled.time_loop.call_each import call_each
from solidsph.engines.compiled.time_loop.merged import MergedLoad
from solidsph.engines.compiled.time_loop.pair_load import pair_arrays, pair_sweep
from solidsph.engines.compiled.vectors import ROW, moved
from solidsph.interfaces.compilable_terms import (
    HourglassLoad,
    PairLoad,
    PointwiseLoad,
    RateStressLoad,
    ScheduledLoad,
)
from solidsph.interfaces.plan import CompilationUnit
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array, Indices

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody


class LoadData(NamedTuple):
    """The data of one load; `own` is specific to its kind."""

    particles: Indices  # (k,)
    before: Array  # (k, d) force at the end of the last step [N]
    work: Array  # (threads,) so far, by thread [J]
    own: Any


class ScheduledForces(NamedTuple):
    """Forces known ahead."""

    table: Array  # (t, k, d) for the steps to come, or (1, k, d) for all of them [N]


class PointwiseData(NamedTuple):
    """Forces by a formula of each particle."""

    reference: Array  # (n, d) X [m]
    values: Array  # (k, m)


class RateBody(NamedTuple):
    """Arrays for the stress of one body."""

    extent: tuple[int, int]  # its first particle and the end of its particles
    table: Indices  # partition among threads
    rows: Rows
    u: NDArray[Any]  # flat
    v: NDArray[Any]  # flat
    params: tuple[float, ...]
    factors: NDArray[Any]
    buffers: NDArray[Any]


class SummedForces(NamedTuple):
    """Forces on all particles by sums over pairs."""

    parts: tuple[Any, ...]  # the arrays of each body, or of all pairs
    now: ScheduledForces  # of the current step


class Setting(NamedTuple):
    """What loads are prepared for."""

    reference: Array  # (n, d) X of all particles [m]
    bodies: Sequence[ReferenceBody]
    threaded: bool  # whether several threads share loops over particles

    @property
    def dimension(self) -> int:
        """d."""
        return int(self.reference.shape[1])


class Call(NamedTuple):
    """A load that is called at every step, and where its forces go."""

    load: Load
    forces: Array  # (k, d) [N]


class CompiledLoad(NamedTuple):
    """A load prepared for the loop."""

    apply: Any  # compiled (load, step, u, v, path, total): total += force, work += that along path
    own: Callable[[Array], Any]  # times (t,) at which the steps to come end -> `LoadData.own`
    called: Call | None = None  # if its forces are those that a call has put into `own`
    merged: MergedLoad | None = None  # if they are among the internal forces


class LoadKind(NamedTuple):
    """How loads of one kind are compiled into the loop."""

    kind: Any  # a class of loads
    prepare: Callable[[Any, Setting], CompiledLoad]
    unit: CompilationUnit
    formula: bool = True  # True if each class of the kind is compiled separately


def kind_of(load: Load) -> LoadKind | None:
    """The kind of a load; None if the loop does not know it, and calls the load."""
    return next((known for known in LOAD_KINDS if isinstance(load, known.kind)), None)


def compiled_load(load: Load, setting: Setting, merged: MergedLoad | None = None) -> CompiledLoad:
    """A load, prepared, and maybe `merged` with the internal forces.

    One of no known kind, or with a formula that does not compile, is called.
    """
    if merged is not None and merged.load is load:
        return CompiledLoad(merged.apply, lambda times: (), merged=merged)
    kind = kind_of(load)
    if kind is not None:
        with suppress(NotCompilableError):
            return kind.prepare(load, setting)
    now = ScheduledForces(np.zeros((1, len(load.particles), setting.dimension)))
    return CompiledLoad(_given(setting), lambda times: now, Call(load, now.table[0]))


def _given(setting: Setting) -> Any:
    """`CompiledLoad.apply` for forces in a table."""
    return _accounted(_scheduled(setting.dimension), setting.dimension, setting.threaded)


def _prepare_scheduled(load: ScheduledLoad, setting: Setting) -> CompiledLoad:
    return CompiledLoad(
        _given(setting),
        lambda times: ScheduledForces(np.ascontiguousarray(load.schedule(times))),
    )


def _summed(setting: Setting, sums: Sequence[Any], parts: Sequence[Any]) -> CompiledLoad:
    """A load with compiled sums (part, u, v, forces (n, d)), one for each part, that write forces
    of all particles."""
    own = SummedForces(tuple(parts), ScheduledForces(np.zeros((1, *setting.reference.shape))))
    return CompiledLoad(_summing(call_each(tuple(sums)), _given(setting)), lambda times: own)


def _prepare_hourglass(load: HourglassLoad, setting: Setting) -> CompiledLoad:
    sweeps = compiled_sweeps(load.operators)
    sums = [body_sweep(sweep.sweep) for sweep in sweeps]
    return _summed(setting, sums, [sweep.arrays for sweep in sweeps])


def _prepare_rate_stress(load: RateStressLoad, setting: Setting) -> CompiledLoad:
    d, dtype = setting.dimension, setting.bodies[0].u.dtype.name
    sums, bodies = [], []
    for part in setting.bodies:
        if not part.fused:
            raise NotCompilableError("a divergence that is not the adjoint of the gradient")
        params, own = load.params_of(part.body), part.gradient_partition
        law = compiled_rate_flux(part.body.formulation, load.stress, d, len(params))
        sums.append(_rate_body(rate_pass(d, dtype, law, own.threaded)))
        bodies.append(
            RateBody(
                extent=(part.body.extent.start, part.body.extent.stop),
                table=own.table,
                rows=part.gradient,
                # Flat displacements and buffers are free once the internal forces are there.
                u=part.u,
                v=np.zeros_like(part.u),
                params=params,
                factors=part.factors,
                buffers=own.buffers,
            )
        )
    return _summed(setting, sums, bodies)


def _prepare_pairs(load: PairLoad, setting: Setting) -> CompiledLoad:
    d, table = setting.dimension, load.pairs
    count, vector = table.values.shape[1], numbers_type(d)
    pull, together = compiled_function(load.pull, vector, vector, numbers_type(count)), False
    with suppress(NotCompilableError):
        lanes = lanes_type(d, LANES)
        compiled_function(load.pull, lanes, lanes, numbers_type(count))
        together = True
    threads = thread_count(len(table.columns)) if setting.threaded else 1
    sweep = pair_sweep(pull, d, count, together, threads > 1)
    arrays = pair_arrays(table, setting.reference, threads, together=together)
    return _summed(setting, [sweep], [arrays])


def _prepare_pointwise(load: PointwiseLoad, setting: Setting) -> CompiledLoad:
    d, values = setting.dimension, np.ascontiguousarray(load.values)
    count, vector = values.shape[1], numbers_type(d)
    force = compiled_function(load.force, vector, vector, numbers_type(count))
    pointwise = PointwiseData(setting.reference, values)
    return CompiledLoad(
        _accounted(_pointwise(force, d, count), d, setting.threaded), lambda times: pointwise
    )


LOAD_KINDS = (
    LoadKind(ScheduledLoad, _prepare_scheduled, CompilationUnit.LOAD, formula=False),
    LoadKind(HourglassLoad, _prepare_hourglass, CompilationUnit.HOURGLASS_LOAD),
    LoadKind(RateStressLoad, _prepare_rate_stress, CompilationUnit.RATE_LOAD),
    LoadKind(PairLoad, _prepare_pairs, CompilationUnit.PAIR_LOAD),
    LoadKind(PointwiseLoad, _prepare_pointwise, CompilationUnit.LOAD),
)
"""The kinds of load that the loop can compile."""


@cache
def _accounted(fill: Any, dimension: int, threaded: bool) -> Any:
    # Threads can take arrays or tuples of arrays as arguments, but no nested tuples.
    @njit(parallel=threaded)
    def add(particles, before, works, own, step, u, v, path, total):
        threads, count = len(works), len(particles)
        for t in prange(threads):
            force = np.empty(dimension)
            work = 0.0
            for m in range(t * count // threads, (t + 1) * count // threads):
                p = particles[m]
                fill(own, step, m, p, u, v, force)
                for i in range(dimension):
                    work += 0.5 * (before[m, i] + force[i]) * path[p, i]
                    before[m, i] = force[i]
                    total[p, i] += force[i]
            works[t] += work

    @njit
    def apply(load, step, u, v, path, total):
        add(load.particles, load.before, load.work, load.own, step, u, v, path, total)

    return apply


@cache
def _scheduled(dimension: int) -> Any:
    @njit
    def fill(own, step, m, p, u, v, force):
        row = min(step, len(own.table) - 1)
        for i in range(dimension):
            force[i] = own.table[row, m, i]

    return fill


@cache
def _rate_body(forces: Any) -> Any:
    @njit
    def of_body(body, u, v, total):
        a, b = body.extent
        forces(
            body.table,
            body.rows,
            u[a:b],
            v[a:b],
            body.u,
            body.v,
            body.params,
            body.factors,
            body.buffers,
            total[a:b],
        )

    return of_body


@cache
def _summing(each: Any, account: Any) -> Any:
    @njit
    def apply(load, step, u, v, path, total):
        own = load.own
        each(own.parts, u, v, own.now.table[0])
        account(LoadData(load.particles, load.before, load.work, own.now), 0, u, v, path, total)

    return apply


@cache
def _pointwise(formula: Any, dimension: int, count: int) -> Any:
    row = ROW[dimension]

    @njit
    def fill(own, step, m, p, u, v, force):
        values = to_fixed_tuple(own.values[m], count)
        found = formula(moved(row(own.reference, p), 1.0, row(u, p)), row(v, p), values)
        for i in range(dimension):
            force[i] = found[i]

    return fill
