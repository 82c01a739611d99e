"""Compiled functions of parts of different types, called one after the other."""

from __future__ import annotations

from functools import cache
from typing import Any

from solidsph.engines.compiled.jit import njit


@cache
def call_each(functions: tuple[Any, ...]) -> Any:
    """Compiled (parts, *arguments) that calls the k-th function with the k-th part and these.

    Parts may be of different types, so the calls are unrolled; without parts there is no code.
    """
    if not functions:

        @njit
        def nothing(parts, *arguments):
            pass

        return nothing

    first, rest = functions[0], call_each(functions[1:])

    @njit
    def each(parts, *arguments):
        first(parts[0], *arguments)
        rest(parts[1:], *arguments)

    return each
