"""Plan: how an engine would carry out a run, in counts from which its cost is predicted.

The counts do not depend on the speed of the machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum

import attrs
import numpy as np
from numpy.typing import NDArray


class SumMethod(Enum):
    """How sums over neighbours are evaluated, on which the cost of a pair depends."""

    PRODUCTS = "products of sparse matrices"
    PRODUCTS_ANEW = "products of sparse matrices, formed anew at every evaluation"
    STENCILS = "compiled, weights that neighbouring particles share"
    ROWS = "compiled, weights of each particle's own"
    FORMULAS = "compiled, moving neighbours, weights by formula"
    WEIGHTS = "compiled, moving neighbours, weights by arrays"
    PAIR_ARRAYS = "forces of pairs, by arrays"
    PAIR_LOOPS = "forces of pairs, compiled"
    HOURGLASS_PRODUCTS = "hourglass forces, as products of sparse matrices"
    HOURGLASS_SWEEPS = "hourglass forces, compiled"
    UNKNOWN = "by a method that is not known here"


@attrs.frozen
class Operations:
    """One part of the work of an evaluation."""

    method: SumMethod
    pairs: int  # ordered pairs visited
    particles: int
    touched: int  # bytes moved at least once
    held: int  # bytes of the arrays kept between evaluations
    precision: int = 8  # bytes per number in the sums
    threaded: bool = False  # True if several threads share the work


class CompilationUnit(Enum):
    """Code that a process has to compile, or to read from the disk, once per key."""

    ENGINE = "the engine, laws and the layout of rows"
    MOVING_ENGINE = "the engine, laws and the search for neighbours"
    FORCES = "sums over neighbours, from displacement to force at once"
    STAGED = "sums over neighbours, stress between"
    MOVING = "sums over moving neighbours"
    FIELDS = "deformation for reports"
    STEPS = "the time loop"
    LOAD = "a load in the time loop"
    PAIR_LOAD = "forces of pairs in the time loop"
    RATE_LOAD = "forces of a stress by the rate of deformation in the time loop"
    HOURGLASS_LOAD = "hourglass forces in the time loop"
    SWEEPS = "hourglass forces outside of it"
    EXTENSION = "ghosts that follow in the time loop"


@attrs.frozen
class Compilation:
    """One compilation; equal ones are compiled once."""

    unit: CompilationUnit
    dimension: int
    threaded: bool
    key: object = None  # distinguishes variants of one unit
    on_disk: bool = attrs.field(default=False, eq=False)  # it need only be read


@attrs.frozen
class Plan:
    """How a run is carried out."""

    compiles_steps: bool  # True if steps are compiled, but for loads that are called
    engine: Sequence[Operations]  # of the internal forces, per evaluation
    loads: Sequence[Operations] = ()  # of everything else, per evaluation
    compilations: frozenset[Compilation] = frozenset()
    called: Sequence[str] = ()  # labels of loads that compiled steps call


@attrs.frozen
class BodySize:
    """The size of a body that need not be built yet."""

    dimension: int
    particles: float
    pairs: float  # ordered pairs within the support, self pairs included
    moving: bool  # True if neighbours are those of the current configuration
    lattice: bool = False  # True if its particles are on the default arrangement
    filters: bool = False  # True if it filters its dilatation


def array_bytes(arrays: Iterable[NDArray[np.generic]]) -> int:
    """Memory of these arrays [bytes]."""
    return sum(array.nbytes for array in arrays)


def vectors(particles: int, dimension: int) -> int:
    """Bytes of the displacements that an evaluation reads and the forces that it writes."""
    return 2 * 8 * particles * dimension
