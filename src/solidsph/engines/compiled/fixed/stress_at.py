"""The stress at a particle, from H and from what the material remembers there."""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.np.unsafe.ndarray import to_fixed_tuple

from solidsph.engines.compiled.jit import njit


@cache
def of_law(law: Any) -> Any:
    """Compiled (p, H, params, history (n, 0), step) -> T for a compiled law (H, params) -> T."""
    return njit(lambda p, H, params, history, step: law(H, params))


@cache
def of_history_law(law: Any, count: int) -> Any:
    """Compiled (p, H, params, history (n, count), step) -> T, which moves the history on, for a
    compiled law (H, h, step, params) -> (T, h)."""

    @njit
    def stress_at(p, H, params, history, step):
        T, h = law(H, to_fixed_tuple(history[p], count), step, params)
        for k in range(count):
            history[p, k] = h[k]
        return T

    return stress_at
