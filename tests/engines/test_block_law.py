"""Laws over blocks: particles together beside particles one by one."""

from __future__ import annotations

import numpy as np
import pytest
from numba import types

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.block_law import block_law
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.fixed.lane_tensors import WIDTH
from solidsph.engines.compiled.fixed.lanes import Lanes, lanes_type
from solidsph.engines.compiled.fixed.partition import padded
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import (
    compiled_function,
    compiles,
    numbers_type,
    registered,
)
from solidsph.interfaces.history import HistoryMaterial
from solidsph.maths.tensors import add, determinant, identity, scale
from solidsph.registry.registry import names
from solidsph.testing.examples import example_part


def yielding(H, h, step, params):
    """Of an iteration, a branch and a constant component; the second variable counts."""
    size = np.abs(determinant(add(H, identity(H)))) + h[0]
    x = size
    for _ in range(30):
        before = x
        x = 0.5 * (x + size / x)
        if not np.any(np.abs(x - before) > 1e-15 * x):
            break
    return add(scale(params[0] * x, H), identity(H)), (x, h[1] + step)


def swinging(H, h, step, params):
    """Of a function that lanes do not know."""
    return scale(params[0] * np.cos(H[0][0]), H), (h[0] + H[0][0], h[1] + step)


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("law", [yielding, swinging])
def test_a_block_has_the_law_of_its_particles(dimension, dtype, law):
    d, D, n = dimension, STRIDE[dimension], 40
    *_, margin, plane = block_loops(d, dtype)
    apply = block_law(d, dtype, njit(error_model="numpy")(registered(law)), 2, 1)
    rng = np.random.default_rng(0)
    for size in (1, WIDTH - 1, WIDTH, 2 * WIDTH + 1):
        for start in (0, 3, n - size):
            # What is beyond the block must neither count nor change.
            scratch = np.full(d * plane, np.nan, dtype=dtype)
            places = np.arange(margin * D, (margin + size) * D).reshape(size, D)[:, :d]
            H = 0.1 * rng.standard_normal((size, d, d)).astype(dtype)
            for k in range(d):
                scratch[k * plane + places] = H[:, :, k]
            history = padded(rng.uniform(1.0, 2.0, (n, 2)), "float64")
            factors = padded(rng.uniform(1.0, 2.0, n), dtype)
            before = history.copy()
            apply(scratch, start, size, (3.0,), factors, history, 0.5)
            own = slice(start, start + size)
            T, after = law(
                np.moveaxis(H.astype(np.float64), 0, -1), tuple(before[own].T), 0.5, (3.0,)
            )
            for i in range(d):
                for k in range(d):
                    # Rounding, of the number type of the result.
                    np.testing.assert_allclose(
                        scratch[k * plane + places[:, i]],
                        T[i][k] * factors[own],
                        rtol=8.0 * np.finfo(dtype).eps,
                        atol=8.0 * np.finfo(dtype).eps,
                    )
            np.testing.assert_allclose(history[own], np.stack(after, axis=1), rtol=1e-14)
            others = np.delete(np.arange(n), np.arange(start, start + size))
            np.testing.assert_array_equal(history[others], before[others])


@pytest.mark.parametrize("name", names("materials"))
def test_lanes_know_all_that_built_in_laws_are_made_of(name):
    """In space; a law that they do not know is slower, and nothing else would tell."""
    law = example_part("materials", name)
    lanes = Lanes(types.float64, WIDTH)
    F, params = types.UniTuple(lanes_type(3, WIDTH), 3), numbers_type(len(law.params))
    if not isinstance(law, HistoryMaterial):
        assert compiles(compiled_function(law.first_piola, *_numbers_of(law)), F, params)
        return
    h = types.UniTuple(lanes, len(law.initial_history(3)))
    of_numbers = numbers_type(len(law.initial_history(3)))
    tensor, few = _numbers_of(law)
    advance = compiled_function(law.advance, tensor, of_numbers, types.float64, few)
    stress = compiled_function(law.stress, tensor, of_numbers, few)
    assert compiles(advance, F, h, types.float64, params)
    assert compiles(stress, F, h, params)


def _numbers_of(law):
    return types.UniTuple(numbers_type(3), 3), numbers_type(len(law.params))
