"""The loops that are timed: internal forces of one body by each engine."""

from __future__ import annotations

import time
from collections.abc import Callable

import attrs
import numba
import numpy as np

from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.engines.matrix import MatrixEngine, MatrixForces
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Loop:
    """One evaluation of forces, ready to be repeated."""

    run: Callable[[], Array]
    pairs: int
    bytes: int  # of the engine's arrays
    build: float  # time to make them [s]
    first: float  # time of the first evaluation, compilation included [s]


def compiled_loop(body: Body, displacements: Array, precision: str, threads: int) -> Loop:
    """By the compiled engine."""
    numba.set_num_threads(threads)
    start = time.perf_counter()
    forces = CompiledEngine(precision).prepare([body], [])
    build = time.perf_counter() - start
    assert isinstance(forces, CompiledForces)

    def run() -> Array:
        numba.set_num_threads(threads)
        return forces.forces(0.0, displacements)

    return _started(run, forces, forces.bytes, build)


def matrix_loop(body: Body, displacements: Array) -> Loop:
    """By the matrix engine, which has one thread and float64."""
    start = time.perf_counter()
    forces = MatrixEngine().prepare([body], [])
    build = time.perf_counter() - start
    assert isinstance(forces, MatrixForces)
    operators = forces.parts[0].operators(displacements)
    memory = sum(
        array.nbytes
        for matrix in (operators.gradient, operators.force)
        for array in (matrix.data, matrix.indices, matrix.indptr)
    )
    return _started(lambda: forces.forces(0.0, displacements), forces, memory, build)


def _started(run: Callable[[], Array], forces: InternalForces, memory: int, build: float) -> Loop:
    start = time.perf_counter()
    run()
    first = time.perf_counter() - start
    return Loop(run, forces.pair_count, memory, build, first)


def multiply_adds(dimension: int) -> int:
    """Of one pair and evaluation: its part of H is an outer product, its force a product T g."""
    return 2 * dimension**2


def least_traffic(loop: Loop, body: Body) -> int:
    """Bytes that one evaluation must move: the engine's arrays, displacements and forces, once."""
    return loop.bytes + 2 * int(np.prod(body.particles.positions.shape)) * 8
