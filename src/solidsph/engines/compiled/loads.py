"""Loads in the compiled loop: their forces, and the work that they do."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange, types
from numba.core.errors import NumbaError
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from solidsph.arrays import Array, Indices
from solidsph.engines.compiled.chain import chain
from solidsph.engines.compiled.mismatch import MismatchSweeps, Sweeps, body_sweep
from solidsph.engines.compiled.pointwise import NotCompilableError, registered
from solidsph.interfaces.condition import ForceCondition
from solidsph.interfaces.declared import (
    LinearForce,
    MismatchForce,
    PointwiseForce,
    ScheduledForce,
)
from solidsph.mismatch import MismatchOperator


class Load(NamedTuple):
    """What the loop holds of one load; `own` is what its kind needs."""

    particles: Indices  # (k,)
    before: Array  # (k, d) force at the end of the last step [N]
    work: Array  # (threads,) done so far, by thread [J]
    own: Any


class Scheduled(NamedTuple):
    """Forces known ahead."""

    table: Array  # (t, k, d) for the steps to come, or (1, k, d) for all of them [N]


class Pointwise(NamedTuple):
    """Forces by a formula."""

    reference: Array  # (n, d) X [m]
    values: Array  # (k, m)


class Linear(NamedTuple):
    """Forces by a constant sparse matrix, whose rows stand as its particles do."""

    starts: NDArray[np.int32]
    columns: NDArray[np.int32]
    weights: Array


class Mismatched(NamedTuple):
    """Forces of mismatches."""

    bodies: tuple[Sweeps, ...]
    now: Scheduled  # those of the step in hand


class LoadPass(NamedTuple):
    """A load made ready for the loop."""

    apply: Any  # compiled (load, step, u, v, path, total): total += force, work += that along path
    own: Callable[[Array], Any]  # times (t,) at which the steps to come end -> what its kind needs


def load_pass(load: ForceCondition, reference: Array, threaded: bool) -> LoadPass:
    """The pass of a load on particles whose X is `reference` (n, d) [m].

    Raises:
        NotCompilableError: the load is not of a declared kind, or its formula does not compile.
    """
    d = reference.shape[1]
    match load:
        case ScheduledForce():
            return LoadPass(
                _accounted(_scheduled(d), d, threaded),
                lambda times: Scheduled(np.ascontiguousarray(load.schedule(times))),
            )
        case LinearForce():
            matrix = load.matrix
            linear = Linear(matrix.indptr, matrix.indices, matrix.data)
            return LoadPass(_accounted(_linear(d), d, threaded), lambda times: linear)
        case MismatchForce():
            sweeps = [_sweeps(operator) for operator in load.operators]
            own = Mismatched(
                tuple(one.arrays for one in sweeps), Scheduled(np.zeros((1, *reference.shape)))
            )
            each = chain(tuple(body_sweep(one.sweep) for one in sweeps))
            account = _accounted(_scheduled(d), d, threaded)
            return LoadPass(_mismatch(each, account), lambda times: own)
        case PointwiseForce():
            values = np.ascontiguousarray(load.values)
            count = values.shape[1]
            formula = _pointwise(_formula(load.force, d, count), d, count)
            pointwise = Pointwise(reference, values)
            return LoadPass(_accounted(formula, d, threaded), lambda times: pointwise)
    raise NotCompilableError(f"load {load.label!r} is not of a declared kind")


@cache
def _accounted(fill: Any, dimension: int, threaded: bool) -> Any:
    # Threads are handed arrays, or arguments that are tuples of them, but no tuple within a tuple.
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
def _linear(dimension: int) -> Any:
    @njit
    def fill(own, step, m, p, u, v, force):
        force[:] = 0.0
        for k in range(own.starts[m], own.starts[m + 1]):
            q, weight = own.columns[k], own.weights[k]
            for i in range(dimension):
                force[i] -= weight * u[q, i]

    return fill


@cache
def _mismatch(each: Any, account: Any) -> Any:
    @njit
    def apply(load, step, u, v, path, total):
        own = load.own
        each(own.bodies, u, own.now.table[0])
        account(Load(load.particles, load.before, load.work, own.now), 0, u, v, path, total)

    return apply


def _sweeps(operator: MismatchOperator) -> MismatchSweeps:
    if isinstance(operator, MismatchSweeps):
        return operator
    return MismatchSweeps.of(operator.mismatch)


@cache
def _pointwise(formula: Any, dimension: int, count: int) -> Any:
    vector, moved = _VECTOR[dimension], _MOVED[dimension]

    @njit
    def fill(own, step, m, p, u, v, force):
        values = to_fixed_tuple(own.values[m], count)
        found = formula(moved(own.reference, u, p), vector(v, p), values)
        for i in range(dimension):
            force[i] = found[i]

    return fill


# Rows of arrays (n, d) as tuples: (values, p) -> values[p], and (X, u, p) -> X[p] + u[p].
_VECTOR = {
    1: njit(lambda a, p: (a[p, 0],)),
    2: njit(lambda a, p: (a[p, 0], a[p, 1])),
    3: njit(lambda a, p: (a[p, 0], a[p, 1], a[p, 2])),
}
_MOVED = {
    1: njit(lambda a, b, p: (a[p, 0] + b[p, 0],)),
    2: njit(lambda a, b, p: (a[p, 0] + b[p, 0], a[p, 1] + b[p, 1])),
    3: njit(lambda a, b, p: (a[p, 0] + b[p, 0], a[p, 1] + b[p, 1], a[p, 2] + b[p, 2])),
}


@cache
def _formula(force: Any, dimension: int, count: int) -> Any:
    """The compiled formula of a pointwise force."""
    formula = njit(registered(force))
    vector = types.UniTuple(types.float64, dimension)
    try:
        formula.compile((vector, vector, types.UniTuple(types.float64, count)))
    except NumbaError as cause:
        raise NotCompilableError(str(cause)) from cause
    return formula
