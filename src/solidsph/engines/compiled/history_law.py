"""The law of a material that remembers, compiled: one loop over the particles of a body."""

from __future__ import annotations

from functools import cache
from typing import Any, final

import attrs
import numpy as np
from numba import njit, types

from solidsph.engines.compiled.pointwise import (
    NUMBERS,
    NotCompilableError,
    compiled_function,
    numbers_type,
    registered,
    tensor_type,
)
from solidsph.interfaces.body import Body
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import Law
from solidsph.maths.arrays import Array


@final
@attrs.frozen(eq=False)
class CompiledLaw(Law):
    """Point by point, in one compiled loop."""

    body: Body
    loop: Any

    @classmethod
    def of(cls, body: Body) -> CompiledLaw:
        """That of a body whose material remembers.

        Raises:
            NotCompilableError: the material does not remember, or does not compile.
        """
        material, formulation = body.material, body.formulation
        if not isinstance(material, HistoryMaterial):
            raise NotCompilableError(f"{type(material).__name__} remembers nothing")
        d = body.smoothing.dimension
        count = len(material.initial_history(d))
        F, h, params = tensor_type(d), numbers_type(count), numbers_type(len(material.params))
        compiled_function(material.advance, F, h, types.float64, params)
        compiled_function(material.stress, F, h, params)
        loop = _loop(
            d,
            count,
            formulation.deformation_gradient,
            material.advance,
            material.stress,
            formulation.flux,
        )
        return cls(body, loop)

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        n, d, _ = H.shape
        stress, after = np.empty((d, d, n)), np.empty_like(history)
        self.loop(H, history, step, self.body.material.params, stress, after)
        return stress, after


@cache
def _loop(
    dimension: int, count: int, deformation_gradient: Any, advance: Any, stress: Any, flux: Any
) -> Any:
    F_of, advanced, P_of, T_of = (
        registered(one) for one in (deformation_gradient, advance, stress, flux)
    )
    numbers, tensor, variables = NUMBERS[dimension], _tensor(dimension), _tuple(count)
    put = _put(count)

    @njit(error_model="numpy")
    def loop(H, history, step, params, out, after):
        for p in range(len(H)):
            F = F_of(tensor(H, p))
            h = variables(history, p)
            if step > 0.0:
                h = advanced(F, h, step, params)
            put(after, p, h)
            T = numbers(T_of(F, P_of(F, h, params)))
            for i in range(dimension):
                for k in range(dimension):
                    out[i, k, p] = T[i][k]

    return loop


@cache
def _tensor(dimension: int) -> Any:
    """Compiled (array (n, d, d), p) -> nested tuple."""
    if dimension == 1:
        return njit(lambda A, p: ((A[p, 0, 0],),))
    if dimension == 2:
        return njit(lambda A, p: ((A[p, 0, 0], A[p, 0, 1]), (A[p, 1, 0], A[p, 1, 1])))
    return njit(
        lambda A, p: (
            (A[p, 0, 0], A[p, 0, 1], A[p, 0, 2]),
            (A[p, 1, 0], A[p, 1, 1], A[p, 1, 2]),
            (A[p, 2, 0], A[p, 2, 1], A[p, 2, 2]),
        )
    )


@cache
def _tuple(count: int) -> Any:
    """Compiled (array (n, k), p) -> tuple of k numbers."""
    if count == 1:
        return njit(lambda array, p: (array[p, 0],))
    first, last = _tuple(count - 1), count - 1

    @njit
    def joined(array, p):
        return first(array, p) + (array[p, last],)  # noqa: RUF005  unpacking does not compile

    return joined


@cache
def _put(count: int) -> Any:
    """Compiled (array (n, k), p, values): the row is the values."""

    @njit
    def put(array, p, values):
        for k in range(count):
            array[p, k] = values[k]

    return put
