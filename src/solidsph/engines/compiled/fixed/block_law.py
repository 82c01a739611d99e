"""The law over the particles of one block: in scratch, gradients become stresses.

Particles are taken together, as lanes, by a law that compiles for these, and one by one otherwise.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import types
from numba.np.unsafe.ndarray import to_fixed_tuple

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed import lane_arithmetic as lane_arithmetic  # for formulas
from solidsph.engines.compiled.fixed import lane_functions as lane_functions
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.fixed.lane_tensors import WIDTH, lane_tensors
from solidsph.engines.compiled.fixed.lanes import Lanes, lanes_type
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import compiles, numbers_type


@cache
def block_law(dimension: int, dtype: str, law: Any, variables: int, params: int) -> Any:
    """Compiled (scratch, start, size, params, factors, history (n, k), step), for a compiled law
    (H, h, step, params) -> (T, h).

    The block has `size` particles from `start` on; their stress is multiplied by the factors, and
    what they remember is that at the end of the step.

    Args:
        dimension: d.
        dtype: number type of the scratch array.
        law: the law.
        variables: k, the number of internal variables.
        params: the number of parameters.
    """
    lanes = Lanes(types.float64, WIDTH)
    tensor = types.UniTuple(lanes_type(dimension, WIDTH), dimension)
    numbers = types.UniTuple(lanes, variables)
    if compiles(law, tensor, numbers, types.float64, numbers_type(params)):
        return _together(dimension, dtype, law, variables)
    return _one_by_one(dimension, dtype, law, variables)


def _one_by_one(dimension: int, dtype: str, law: Any, variables: int) -> Any:
    _, _, tensor, put, _, _ = block_loops(dimension, dtype)

    @njit
    def apply(scratch, start, size, params, factors, history, step):
        for slot in range(size):
            p = start + slot
            h = to_fixed_tuple(history[p], variables)
            T, h = law(tensor(scratch, slot), h, step, params)
            for k in range(variables):
                history[p, k] = h[k]
            put(scratch, slot, T, factors[p])

    return apply


def _together(dimension: int, dtype: str, law: Any, variables: int) -> Any:
    *_, margin, plane = block_loops(dimension, dtype)
    get, put, numbers, keep = lane_tensors(dimension, dtype, variables)
    D = STRIDE[dimension]

    @njit
    def apply(scratch, start, size, params, factors, history, step):
        for slot in range(0, size, WIDTH):
            p, at, left = start + slot, (margin + slot) * D, size - slot
            H, h = get(scratch, at, plane, left), numbers(history, p, left)
            T, h = law(H, h, step, params)
            keep(history, p, left, h)
            put(scratch, at, plane, T, factors, p)

    return apply
