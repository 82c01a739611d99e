"""The law of a material with history, as one compiled loop over the particles of a body."""

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
        """The law of a body whose material has a history.

        Raises:
            NotCompilableError: the material has no history, or does not compile.
        """
        material, formulation = body.material, body.formulation
        if not isinstance(material, HistoryMaterial):
            raise NotCompilableError(f"{type(material).__name__} has no history")
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
    functions = (deformation_gradient, advance, stress, flux)
    F_of, advanced, P_of, T_of = (registered(function) for function in functions)
    matrix = MATRIX[dimension]

    @njit(error_model="numpy")
    def loop(H, history, step, params, out, after):
        for p in range(len(H)):
            F = F_of(matrix(H, p))
            h = to_fixed_tuple(history[p], count)
            if step > 0.0:
                h = advanced(F, h, step, params)
            for k in range(count):
                after[p, k] = h[k]
            T = numbers(T_of(F, P_of(F, h, params)))
            for i in range(dimension):
                for k in range(dimension):
                    out[i, k, p] = T[i][k]

    return loop
