"""Chain: compiled functions of different kinds of parts, called one after the other."""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import njit


@cache
def call_each(functions: tuple[Any, ...]) -> Any:
    """Compiled (parts, *arguments): calls the k-th function with the k-th part and the arguments.

    Parts may be of different types, so the call_each is unrolled when it compiles, and what is not
    there leaves no code.
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
