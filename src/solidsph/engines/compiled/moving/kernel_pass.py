"""Kernel values at all pairs of moving particles, by the compiled functions of the kernel."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

from numba import types

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.moving.search import Near
from solidsph.engines.compiled.pointwise import NotCompilableError, compiled_function, numbers_type
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import COMPLEX_STEP, SmoothingKernel
from solidsph.maths.arrays import Array

# (near, values (k,), slopes (k,)): W [m^-d] and W'(r) / r [m^-(d+2)] of every pair
KernelPass: TypeAlias = Callable[[Near, Array, Array], None]


def kernel_pass(smoothing: SmoothingKernel) -> KernelPass:
    """Values as of `SmoothingKernel`, compiled, or by its arrays if the kernel does not compile."""
    try:
        loop = _loop(*_functions(smoothing.kernel))
    except NotCompilableError:
        return _by_arrays(smoothing)
    H, d = smoothing.support_radius, smoothing.dimension
    params = tuple(float(number) for number in smoothing.kernel.params)
    of_value, of_slope = smoothing.normalisation / H**d, smoothing.normalisation / H ** (d + 1)

    def compiled(near: Near, values: Array, slopes: Array) -> None:
        loop(near.distances[: near.pair_count], H, params, of_value, of_slope, values, slopes)

    return compiled


def _by_arrays(smoothing: SmoothingKernel) -> KernelPass:
    def arrays(near: Near, values: Array, slopes: Array) -> None:
        k = near.pair_count
        r = near.distances[:k]
        values[:k] = smoothing.value(r)
        slopes[:k] = smoothing.slope_by_distance(r)

    return arrays


def _functions(kernel: Kernel) -> tuple[Any, Any]:
    """Compiled profile (q, params) and its derivative."""
    numbers = numbers_type(len(kernel.params))
    profile = compiled_function(kernel.profile, types.float64, numbers)
    if kernel.slope(0.5, kernel.params) is not None:
        return profile, compiled_function(kernel.slope, types.float64, numbers)
    return profile, _stepped(compiled_function(kernel.profile, types.complex128, numbers))


@cache
def _stepped(profile: Any) -> Any:
    """The derivative by a complex step."""

    @njit(error_model="numpy")
    def slope(q, params):
        return profile(q + 1j * COMPLEX_STEP, params).imag / COMPLEX_STEP

    return slope


@cache
def _loop(profile: Any, slope: Any) -> Any:
    @njit(error_model="numpy")
    def loop(distances, H, params, of_value, of_slope, values, slopes):
        for k in range(len(distances)):
            r = distances[k]
            q = r / H
            values[k] = slopes[k] = 0.0
            if q < 1.0:
                values[k] = profile(q, params) * of_value
                if r > 0.0:
                    slopes[k] = slope(q, params) * of_slope / r

    return loop
