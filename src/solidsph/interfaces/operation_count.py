"""Tally: what an evaluation of forces passes over, counted, and in which way it is carried out."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

import attrs
import numpy as np
from numpy.typing import NDArray


class Way(Enum):
    """How sums over neighbours are carried out; what a pair costs depends on it."""

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
    UNKNOWN = "of a way that is not known here"


@attrs.frozen
class Tally:
    """One part of what an evaluation passes over. Nothing in it depends on the machine's speed."""

    way: Way
    pairs: int  # ordered, that are visited
    particles: int
    touched: int  # bytes that must be moved once at least
    held: int  # bytes of the arrays kept between evaluations
    precision: int = 8  # bytes of a number in the sums
    threaded: bool = False  # whether threads share them


def array_bytes(arrays: Iterable[NDArray[np.generic]]) -> int:
    """Memory of these arrays."""
    return sum(array.nbytes for array in arrays)


def vectors(particles: int, dimension: int) -> int:
    """Bytes of the displacements that an evaluation reads and the forces that it writes."""
    return 2 * 8 * particles * dimension
