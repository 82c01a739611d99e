"""Fields of vectors in planes, one a component: to and from arrays (n, d)."""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import prange

from solidsph.engines.compiled.jit import njit


@cache
def filling(dimension: int, threaded: bool) -> Any:
    """Compiled (threads, field (n, d), array, stride): the field in planes."""

    @njit(parallel=threaded)
    def fill(threads, field, array, stride):
        n = len(field)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(dimension):
                    array[i * stride + p] = field[p, i]

    return fill


@cache
def adding(dimension: int, threaded: bool) -> Any:
    """Compiled (threads, array, stride, field (n, d)): planes added to the field."""

    @njit(parallel=threaded)
    def add(threads, array, stride, field):
        n = len(field)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(dimension):
                    field[p, i] += array[i * stride + p]

    return add
