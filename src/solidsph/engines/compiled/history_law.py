"""The law of a body as one compiled loop over its particles."""

from __future__ import annotations

from functools import cache
from typing import Any, final

import attrs
import numpy as np
from numba import types
from numba.np.unsafe.ndarray import to_fixed_tuple

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import (
    NotCompilableError,
    compiled_flux,
    compiled_function,
    numbers,
    numbers_type,
    registered,
    tensor_type,
)
from solidsph.engines.compiled.vectors import MATRIX
from solidsph.interfaces.body import Body
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import Law
from solidsph.maths.arrays import Array


@final
@attrs.frozen(eq=False)
class CompiledLaw(Law):
    """A law evaluated in one compiled loop."""

    body: Body
    loop: Any

    @classmethod
    def of(cls, body: Body) -> CompiledLaw:
        """The law of a body.

        Raises:
            NotCompilableError: it does not compile.
        """
        d, count = body.smoothing.dimension, history_count(body)
        if count:
            return cls(body, _loop(d, count, history_flux(body)))
        law = compiled_flux(body.formulation, body.material, d)
        return cls(body, _loop(d, count, without_history(law)))

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        n, d, _ = H.shape
        stress, after = np.empty((d, d, n)), np.empty_like(history)
        self.loop(H, history, step, self.body.material.params, stress, after)
        return stress, after


def history_count(body: Body) -> int:
    """Number of internal variables of a particle of the body."""
    material = body.material
    if not isinstance(material, HistoryMaterial):
        return 0
    return len(material.initial_history(body.smoothing.dimension))


def history_flux(body: Body) -> Any:
    """Compiled (H, h, step, params) -> flux(F(H), P(F, h')) and h' at one point.

    Raises:
        NotCompilableError: the material has no history, or does not compile.
    """
    material, formulation = body.material, body.formulation
    if not isinstance(material, HistoryMaterial):
        raise NotCompilableError(f"{type(material).__name__} has no history")
    F, h = tensor_type(body.smoothing.dimension), numbers_type(history_count(body))
    params = numbers_type(len(material.params))
    compiled_function(material.advance, F, h, types.float64, params)
    compiled_function(material.stress, F, h, params)
    return _flux(
        formulation.deformation_gradient, material.advance, material.stress, formulation.flux
    )


def stepping_law(body: Body, law: Any) -> Any:
    """Compiled (H, h, step, params) -> T and h at the end of a step, with the body's `law` if it
    has no history.

    Raises:
        NotCompilableError: the law does not compile.
    """
    return history_flux(body) if history_count(body) else without_history(law)


@cache
def without_history(law: Any) -> Any:
    """Compiled (H, h, step, params) -> (T, h) for a compiled law (H, params) -> T."""
    return njit(error_model="numpy")(lambda H, h, step, params: (law(H, params), h))


@cache
def _flux(deformation_gradient: Any, advance: Any, stress: Any, flux: Any) -> Any:
    functions = (deformation_gradient, advance, stress, flux)
    F_of, advanced, P_of, T_of = (registered(function) for function in functions)

    @njit(error_model="numpy")
    def law(H, h, step, params):
        F = F_of(H)
        if step > 0.0:
            h = advanced(F, h, step, params)
        return numbers(T_of(F, P_of(F, h, params))), h

    return law


@cache
def _loop(dimension: int, count: int, law: Any) -> Any:
    matrix = MATRIX[dimension]

    @njit
    def loop(H, history, step, params, out, after):
        for p in range(len(H)):
            T, h = law(matrix(H, p), to_fixed_tuple(history[p], count), step, params)
            for k in range(count):
                after[p, k] = h[k]
            for i in range(dimension):
                for k in range(dimension):
                    out[i, k, p] = T[i][k]

    return loop
