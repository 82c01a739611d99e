"""Terms of the cost model: counts of work, each with its coefficient and its unit."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from math import exp

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.work import Loop, Work
from solidsph.engines.compiled.constants import PER_PARTICLE, WORTH_A_THREAD
from solidsph.interfaces.plan import CompilationUnit, Operations, SumMethod

# Parallel efficiency of threads that share a sum.
_EFFICIENCY = 0.95

# Outputs whose chunks HDF5 keeps cached.
_CACHED_OUTPUTS = 150.0

# The C library requests larger arrays from the system one by one, which clears every page [bytes].
_LARGE = 128 * 1024

# Time and memory of reading compiled functions from the disk, over those of compiling them.
_READING, _READ = 0.01, 0.35

_OF_BUILD = (CompilationUnit.ENGINE, CompilationUnit.MOVING_ENGINE)


class Unit(Enum):
    """Unit of a term: a time of the calibration, or bytes."""

    SPARSE = "sparse"
    CALLS = "calls"
    COMPILING = "compiling"
    FILING = "filing"
    APPENDING = "appending"
    BYTES = "bytes"

    def size(self, machine: Calibration) -> float:
        """One unit on `machine` [s, or bytes]."""
        return 1.0 if self is Unit.BYTES else float(getattr(machine, self.value))


@attrs.frozen
class CostTerm:
    """A count and the name of its coefficient."""

    name: str
    count: float
    unit: Unit


def build_terms(work: Work) -> Iterator[CostTerm]:
    """Build: particles, operators, and the compilations that these need."""
    d, kind = work.dimension, _kind(work)
    yield CostTerm("build", 1.0, Unit.CALLS)
    yield CostTerm(f"build particle {d}D", work.particles, Unit.SPARSE)
    yield CostTerm(f"build pair {kind} {d}D", work.pairs, Unit.SPARSE)
    for part in work.operations:
        if part.method is SumMethod.HOURGLASS_PRODUCTS or part.method is SumMethod.HOURGLASS_SWEEPS:
            yield CostTerm(f"build hourglass {d}D", part.pairs, Unit.SPARSE)
        if part.method is SumMethod.PAIR_ARRAYS or part.method is SumMethod.PAIR_LOOPS:
            yield CostTerm(f"build force {d}D", part.pairs, Unit.SPARSE)
    yield from _compilations(work, of_build=True)


def compile_terms(work: Work) -> Iterator[CostTerm]:
    """Compilations of the run after its build."""
    yield from _compilations(work, of_build=False)


def step_terms(work: Work) -> Iterator[CostTerm]:
    """One evaluation of the forces and the step around it."""
    d, n = work.dimension, work.particles
    loop = "compiled step" if work.loop is Loop.COMPILED else "step"
    yield CostTerm(f"{loop} {d}D", 1.0, Unit.CALLS)
    yield CostTerm(f"{loop} particle {d}D", n, Unit.SPARSE)
    loads = work.conditions - work.motions
    if work.loop is Loop.COMPILED:  # a load on some particles costs nothing on the others
        local = [
            part for part in work.operations if part.method is SumMethod.UNKNOWN and not part.pairs
        ]
        loads -= len(local)
        count = sum(part.particles for part in local)
        yield CostTerm(f"{loop} loaded particle {d}D", count, Unit.SPARSE)
    for kind, count in (("motion", work.motions), ("load", loads)):
        yield CostTerm(f"{loop} {kind} {d}D", count, Unit.CALLS)
        yield CostTerm(f"{loop} {kind} particle {d}D", count * n, Unit.SPARSE)
    for part in work.operations:
        if part.method is SumMethod.UNKNOWN and not part.pairs:
            continue  # a load on particles, counted among the conditions
        if work.loop is Loop.STEPS:
            yield CostTerm(f"{part.method.name} call", 1.0, Unit.CALLS)
        yield from _sum_terms(part, d)


def shared_terms(work: Work) -> Iterator[CostTerm]:
    """Terms of a step that threads share."""
    d = work.dimension
    if work.loop is Loop.COMPILED and PER_PARTICLE * work.particles >= WORTH_A_THREAD:
        yield CostTerm(f"compiled step particle {d}D", work.particles, Unit.SPARSE)
    for part in work.operations:
        if part.threaded:
            yield from _sum_terms(part, d)


def output_terms(work: Work) -> Iterator[CostTerm]:
    """One observation and its record."""
    d, n = work.dimension, work.particles
    yield CostTerm("output", 1.0, Unit.APPENDING)
    yield CostTerm("output condition", work.conditions, Unit.CALLS)
    yield CostTerm(f"output particle {_kind(work)} {d}D", n, Unit.SPARSE)
    yield CostTerm("output byte", work.record_bytes / work.outputs, Unit.FILING)
    if 8 * n * d * d >= _LARGE:
        yield CostTerm(f"output large particle {d}D", n, Unit.SPARSE)
    for part in work.operations:
        if part.method in (SumMethod.HOURGLASS_PRODUCTS, SumMethod.HOURGLASS_SWEEPS):
            yield CostTerm("output hourglass pair", part.pairs, Unit.SPARSE)


def start_terms(work: Work) -> Iterator[CostTerm]:
    """Creation of the file with its reference data."""
    yield CostTerm("file", 1.0, Unit.APPENDING)
    yield CostTerm("file particle", work.particles, Unit.SPARSE)


def iteration_terms(work: Work) -> Iterator[CostTerm]:
    """One iteration of Newton's method."""
    statics, d = work.statics, work.dimension
    assert statics is not None
    if statics.products:
        yield CostTerm(f"linearised particle {d}D", work.particles, Unit.SPARSE)
        return
    yield CostTerm("iteration", 1.0, Unit.CALLS)
    yield CostTerm(f"tangent pair {d}D", work.pairs, Unit.SPARSE)
    yield CostTerm(f"tangent entry {d}D", statics.entries, Unit.SPARSE)
    factor = "band" if statics.banded else "factor"
    yield CostTerm(f"{factor} entry {d}D", statics.fill, Unit.SPARSE)
    yield CostTerm(f"{factor} multiplication {d}D", statics.multiplications, Unit.SPARSE)


def product_terms(work: Work) -> Iterator[CostTerm]:
    """What goes with a product with the tangent: the preconditioner."""
    yield CostTerm(f"preconditioned particle {work.dimension}D", work.particles, Unit.SPARSE)


def build_memory(work: Work) -> Iterator[CostTerm]:
    """Peak memory of the build, imports excluded."""
    d, kind = work.dimension, _kind(work)
    yield CostTerm("memory of a build", 1.0, Unit.BYTES)
    yield CostTerm(f"memory particle {kind} {d}D", work.particles, Unit.BYTES)
    if kind == "compiled":  # pairs are listed in chunks: only the arrays kept count
        yield CostTerm(f"memory held {d}D", work.held, Unit.BYTES)
    else:
        yield CostTerm(f"memory pair {kind} {d}D", work.pairs, Unit.BYTES)
    yield from _compiler_memory(work)


def left_memory(work: Work) -> Iterator[CostTerm]:
    """Memory in use after the build, imports and the engine's arrays excluded."""
    yield CostTerm("memory of a build", 1.0, Unit.BYTES)
    yield from _compiler_memory(work)


def run_memory(work: Work) -> Iterator[CostTerm]:
    """Memory that a run adds to that in use after the build."""
    d = work.dimension
    yield CostTerm("memory of a run", 1.0, Unit.BYTES)
    # HDF5 caches past outputs up to a limit.
    yield CostTerm("memory of a file", 1.0 - exp(-work.outputs / _CACHED_OUTPUTS), Unit.BYTES)
    yield CostTerm(f"memory of a run, particle {_kind(work)} {d}D", work.particles, Unit.BYTES)
    for part in work.operations:
        if part.method is SumMethod.PRODUCTS_ANEW or part.method is SumMethod.PAIR_ARRAYS:
            yield CostTerm(f"memory of a run, pair {part.method.name} {d}D", part.pairs, Unit.BYTES)
    for c in work.compilations:
        if c.unit not in _OF_BUILD:
            share = _READ if c.on_disk else 1.0
            yield CostTerm(f"memory of {c.unit.name}{_threads(c.threaded)}", share, Unit.BYTES)
    if work.statics is not None:
        yield CostTerm(f"memory of a tangent entry {d}D", work.statics.entries, Unit.BYTES)
        yield CostTerm(f"memory of a factor entry {d}D", work.statics.fill, Unit.BYTES)


def speedup(threads: int) -> float:
    """Speedup of a sum on this many threads [-]."""
    return 1.0 if threads == 1 else _EFFICIENCY * threads


def _sum_terms(part: Operations, d: int) -> Iterator[CostTerm]:
    precision = f" float{8 * part.precision}" if part.precision != 8 else ""
    yield CostTerm(f"{part.method.name} {d}D{precision} pair", part.pairs, Unit.SPARSE)
    if part.method in (
        SumMethod.STENCILS,
        SumMethod.ROWS,
    ):  # the material, always in double precision
        yield CostTerm(f"{part.method.name} {d}D particle", part.particles, Unit.SPARSE)


def _compilations(work: Work, *, of_build: bool) -> Iterator[CostTerm]:
    for part in work.compilations:
        if (part.unit in _OF_BUILD) == of_build:
            share = _READING if part.on_disk else 1.0
            yield CostTerm(
                f"compile {part.unit.name}{_threads(part.threaded)}", share, Unit.COMPILING
            )


def _compiler_memory(work: Work) -> Iterator[CostTerm]:
    for part in work.compilations:
        if part.unit in _OF_BUILD:
            share = _READ if part.on_disk else 1.0
            yield CostTerm(f"memory of {part.unit.name}", share, Unit.BYTES)


def _threads(threaded: bool) -> str:
    return " by threads" if threaded else ""


def _kind(work: Work) -> str:
    """Engine as the names of coefficients have it."""
    ways = {part.method for part in work.operations}
    if ways & {SumMethod.STENCILS, SumMethod.ROWS}:
        return "compiled"
    if ways & {SumMethod.FORMULAS, SumMethod.WEIGHTS}:
        return "moving"
    return "anew" if SumMethod.PRODUCTS_ANEW in ways else "matrix"
