"""Terms: what each count of a run's work is multiplied by, and in which unit of a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from math import exp

import attrs

from solidsph.costs.work import Loop, Work
from solidsph.engines.compiled.constants import PER_PARTICLE, WORTH_A_THREAD
from solidsph.interfaces.plan import CompilationUnit, Operations, SumMethod

# Of the threads that share a sum, what they are together beside one alone.
_TOGETHER = 0.95

# Outputs of which the library of files remembers what it wrote, before it forgets the first.
_REMEMBERED = 150.0

# From this size on the C library asks the system for each array, which clears every page [bytes].
_LARGE = 128 * 1024

_OF_BUILD = (CompilationUnit.ENGINE, CompilationUnit.MOVING_ENGINE)


class Yard(Enum):
    """A time of the calibration: which of a machine's abilities a term depends on."""

    SPARSE = "sparse"
    CALLS = "calls"
    COMPILING = "compiling"
    FILING = "filing"
    APPENDING = "appending"
    BYTES = "bytes"  # none: the term is memory


@attrs.frozen
class CostTerm:
    """A count, and the name of the coefficient that it is to be multiplied by."""

    name: str
    count: float
    yard: Yard


def build_terms(work: Work) -> Iterator[CostTerm]:
    """Of making particles and operators, and compiling what that takes."""
    d, kind = work.dimension, _kind(work)
    yield CostTerm("build", 1.0, Yard.CALLS)
    yield CostTerm(f"build particle {d}D", work.particles, Yard.SPARSE)
    yield CostTerm(f"build pair {kind} {d}D", work.pairs, Yard.SPARSE)
    for part in work.operations:
        if part.method is SumMethod.HOURGLASS_PRODUCTS or part.method is SumMethod.HOURGLASS_SWEEPS:
            yield CostTerm(f"build hourglass {d}D", part.pairs, Yard.SPARSE)
        if part.method is SumMethod.PAIR_ARRAYS or part.method is SumMethod.PAIR_LOOPS:
            yield CostTerm(f"build force {d}D", part.pairs, Yard.SPARSE)
    yield from _pieces(work, of_build=True)


def compile_terms(work: Work) -> Iterator[CostTerm]:
    """Of compiling what a run takes beyond its build."""
    yield from _pieces(work, of_build=False)


def step_terms(work: Work) -> Iterator[CostTerm]:
    """Of one evaluation of the forces and the step around it."""
    d, n = work.dimension, work.particles
    loop = "compiled step" if work.loop is Loop.COMPILED else "step"
    yield CostTerm(f"{loop} {d}D", 1.0, Yard.CALLS)
    yield CostTerm(f"{loop} particle {d}D", n, Yard.SPARSE)
    loads = work.conditions - work.motions
    if work.loop is Loop.COMPILED:  # where what acts on some particles costs nothing on others
        own = [
            part for part in work.operations if part.method is SumMethod.UNKNOWN and not part.pairs
        ]
        loads -= len(own)
        count = sum(part.particles for part in own)
        yield CostTerm(f"{loop} loaded particle {d}D", count, Yard.SPARSE)
    for kind, count in (("motion", work.motions), ("load", loads)):
        yield CostTerm(f"{loop} {kind} {d}D", count, Yard.CALLS)
        yield CostTerm(f"{loop} {kind} particle {d}D", count * n, Yard.SPARSE)
    for part in work.operations:
        if part.method is SumMethod.UNKNOWN and not part.pairs:
            continue  # a load on particles, which is among the conditions
        if work.loop is Loop.STEPS:
            yield CostTerm(f"{part.method.name} call", 1.0, Yard.CALLS)
        yield from _sum_terms(part, d)


def shared_terms(work: Work) -> Iterator[CostTerm]:
    """Those terms of a step that threads share."""
    d = work.dimension
    if work.loop is Loop.COMPILED and PER_PARTICLE * work.particles >= WORTH_A_THREAD:
        yield CostTerm(f"compiled step particle {d}D", work.particles, Yard.SPARSE)
    for part in work.operations:
        if part.threaded:
            yield from _sum_terms(part, d)


def output_terms(work: Work) -> Iterator[CostTerm]:
    """Of one observation and its record."""
    d, n = work.dimension, work.particles
    yield CostTerm("output", 1.0, Yard.APPENDING)
    yield CostTerm("output condition", work.conditions, Yard.CALLS)
    yield CostTerm(f"output particle {_kind(work)} {d}D", n, Yard.SPARSE)
    yield CostTerm("output byte", work.record_bytes / work.outputs, Yard.FILING)
    if 8 * n * d * d >= _LARGE:
        yield CostTerm(f"output large particle {d}D", n, Yard.SPARSE)
    for part in work.operations:
        if part.method in (SumMethod.HOURGLASS_PRODUCTS, SumMethod.HOURGLASS_SWEEPS):
            yield CostTerm("output hourglass pair", part.pairs, Yard.SPARSE)


def start_terms(work: Work) -> Iterator[CostTerm]:
    """Of what is done once besides: the file, and its reference data."""
    yield CostTerm("file", 1.0, Yard.APPENDING)
    yield CostTerm("file particle", work.particles, Yard.SPARSE)


def iteration_terms(work: Work) -> Iterator[CostTerm]:
    """Of an iteration of Newton's method."""
    statics, d = work.statics, work.dimension
    assert statics is not None
    yield CostTerm("iteration", 1.0, Yard.CALLS)
    yield CostTerm(f"tangent pair {d}D", work.pairs, Yard.SPARSE)
    yield CostTerm(f"tangent entry {d}D", statics.entries, Yard.SPARSE)
    yield CostTerm(f"factor entry {d}D", statics.fill, Yard.SPARSE)
    yield CostTerm(f"factor multiplication {d}D", statics.multiplications, Yard.SPARSE)


def build_memory(work: Work) -> Iterator[CostTerm]:
    """Bytes at the peak of the build, beyond imports."""
    d, kind = work.dimension, _kind(work)
    yield CostTerm("memory of a build", 1.0, Yard.BYTES)
    yield CostTerm(f"memory particle {kind} {d}D", work.particles, Yard.BYTES)
    if kind == "compiled":  # pairs are listed some rows at a time: what is kept counts
        yield CostTerm(f"memory held {d}D", work.held, Yard.BYTES)
    else:
        yield CostTerm(f"memory pair {kind} {d}D", work.pairs, Yard.BYTES)
    for one in work.compilations:
        if one.unit in _OF_BUILD:
            yield CostTerm(f"memory of {one.unit.name}", 1.0, Yard.BYTES)


def left_memory(work: Work) -> Iterator[CostTerm]:
    """Bytes that a build leaves, beyond imports and the engine's arrays."""
    yield CostTerm("memory of a build", 1.0, Yard.BYTES)
    for one in work.compilations:
        if one.unit in _OF_BUILD:
            yield CostTerm(f"memory of {one.unit.name}", 1.0, Yard.BYTES)


def run_memory(work: Work) -> Iterator[CostTerm]:
    """Bytes that a run adds to what a build leaves."""
    d = work.dimension
    yield CostTerm("memory of a run", 1.0, Yard.BYTES)
    # The file's library keeps what it knows of past outputs, up to a limit of its own.
    yield CostTerm("memory of a file", 1.0 - exp(-work.outputs / _REMEMBERED), Yard.BYTES)
    yield CostTerm(f"memory of a run, particle {_kind(work)} {d}D", work.particles, Yard.BYTES)
    for part in work.operations:
        if part.method is SumMethod.PRODUCTS_ANEW or part.method is SumMethod.PAIR_ARRAYS:
            yield CostTerm(f"memory of a run, pair {part.method.name} {d}D", part.pairs, Yard.BYTES)
    for one in work.compilations:
        if one.unit not in _OF_BUILD:
            yield CostTerm(f"memory of {one.unit.name}{_threads(one.threaded)}", 1.0, Yard.BYTES)
    if work.statics is not None:
        yield CostTerm(f"memory of a tangent entry {d}D", work.statics.entries, Yard.BYTES)
        yield CostTerm(f"memory of a factor entry {d}D", work.statics.fill, Yard.BYTES)


def together(threads: int) -> float:
    """How much faster a sum is by so many threads."""
    return 1.0 if threads == 1 else _TOGETHER * threads


def _sum_terms(part: Operations, d: int) -> Iterator[CostTerm]:
    precision = f" float{8 * part.precision}" if part.precision != 8 else ""
    yield CostTerm(f"{part.method.name} {d}D{precision} pair", part.pairs, Yard.SPARSE)
    if part.method in (
        SumMethod.STENCILS,
        SumMethod.ROWS,
    ):  # the law, which is in double precision always
        yield CostTerm(f"{part.method.name} {d}D particle", part.particles, Yard.SPARSE)


def _pieces(work: Work, *, of_build: bool) -> Iterator[CostTerm]:
    for one in work.compilations:
        if (one.unit in _OF_BUILD) == of_build:
            yield CostTerm(f"compile {one.unit.name}{_threads(one.threaded)}", 1.0, Yard.COMPILING)


def _threads(threaded: bool) -> str:
    return " by threads" if threaded else ""


def _kind(work: Work) -> str:
    """The engine, as its coefficients name it."""
    ways = {part.method for part in work.operations}
    if ways & {SumMethod.STENCILS, SumMethod.ROWS}:
        return "compiled"
    if ways & {SumMethod.FORMULAS, SumMethod.WEIGHTS}:
        return "moving"
    return "anew" if SumMethod.PRODUCTS_ANEW in ways else "matrix"
