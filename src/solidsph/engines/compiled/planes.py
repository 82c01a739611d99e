"""Fields of vectors in planes, one a component: vectors of numbers, or of lanes of them."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

from numba import prange

from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.jit import njit


class Planes(NamedTuple):
    """Compiled reading and writing of a flat array, whose planes are `stride` apart."""

    get: Any  # (array, stride, at) -> vector
    put: Any  # (array, stride, at, vector)


@cache
def planes(components: int, lanes: int | None = None) -> Planes:
    """For vectors of so many components; each is a number, or so many lanes."""
    if lanes is None:
        return _planes(components, _number, _set_number)
    operations = lane_operations("float64", lanes, 1)
    return _planes(components, operations.load, operations.store)


@cache
def _planes(components: int, load: Any, store: Any) -> Planes:
    if components == 0:
        return Planes(njit(lambda array, stride, at: ()), njit(lambda array, stride, at, a: None))
    last = components - 1
    get_fewer, put_fewer = _planes(last, load, store)

    @njit
    def get(array, stride, at):
        return get_fewer(array, stride, at) + (load(array, at + last * stride),)  # noqa: RUF005

    @njit
    def put(array, stride, at, a):
        put_fewer(array, stride, at, a)
        store(array, at + last * stride, a[last])

    return Planes(get, put)


@njit
def _number(array, at):
    return array[at]


@njit
def _set_number(array, at, value):
    array[at] = value


@cache
def plus(components: int) -> Any:
    """Compiled (a, b) -> a + b."""
    if components == 0:
        return njit(lambda a, b: ())
    fewer, last = plus(components - 1), components - 1
    return njit(lambda a, b: fewer(a, b) + (a[last] + b[last],))  # noqa: RUF005


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
