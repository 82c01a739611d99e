"""Maxwell elements side by side, as formulas that the compiler can take.

The compiler must know how many numbers a formula takes and gives. So what is a loop over elements
is composed here, once for each number of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from solidsph.interfaces.history import History
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import add, contraction, identity, scale, trace
from solidsph_builtin.materials._symmetric import components, first_components, later, symmetric

Params = tuple[float, ...]
"""mu_i [Pa] and tau_i [s] of one element after the other."""


@cache
def creep(count: int) -> Callable[..., tuple[History, Scalar]]:
    """(E, strain before, its change, history, step, params) -> viscous strains, and the energy
    [J/m^3] that is dissipated, of this number of elements."""
    if count == 1:
        return _creep
    others = creep(count - 1)

    def both(
        E: Tensor, before: Tensor, change: Tensor, history: History, step: float, params: Params
    ) -> tuple[History, Scalar]:
        strain, lost = _creep(E, before, change, history, step, params)
        more, further = others(E, before, change, later(history, E), step, params[2:])
        return strain + more, lost + further

    return both


@cache
def overstress(count: int) -> Callable[..., Tensor]:
    """(E, history, params) -> sum of 2 mu_i dev(E - E_i) [Pa]."""
    if count == 1:
        return _overstress
    others = overstress(count - 1)

    def both(E: Tensor, history: History, params: Params) -> Tensor:
        more = others(E, later(history, E), params[2:])
        return add(_overstress(E, history, params), more)

    return both


@cache
def after(count: int) -> Callable[..., History]:
    """(history, E) -> the variables after those of this number of elements."""
    if count == 1:
        return later
    fewer = after(count - 1)

    def beyond(history: History, E: Tensor) -> History:
        return later(fewer(history, E), E)

    return beyond


def element_energy(E: Tensor, history: History, params: Any) -> Scalar:
    """mu |dev(E - E_i)|^2 of the first element [J/m^3]."""
    e = _elastic(E, history)
    return params[0] * deviator_product(e, e)


def _creep(
    E: Tensor, before: Tensor, change: Tensor, history: History, step: float, params: Params
) -> tuple[History, Scalar]:
    mu, x = params[0], step / params[1]
    faded = -np.expm1(-x)
    # E is linear over the step: q = E - E_i, at a part s of tau after its beginning, is
    # q_0 exp(-s) + (1 - exp(-s)) change / x, and 2 mu |dev q|^2 is integrated over s.
    q = _elastic(before, history)
    lost = (
        2.0
        * mu
        * (
            0.5 * faded * (2.0 - faded) * deviator_product(q, q)
            + faded**2 / x * deviator_product(q, change)
            + _rise(x) * deviator_product(change, change)
        )
    )
    q = add(scale(1.0 - faded, q), scale(faded / x, change))
    return components(add(E, scale(-1.0, q))), lost


def _overstress(E: Tensor, history: History, params: Params) -> Tensor:
    return scale(2.0 * params[0], deviator(_elastic(E, history)))


def _elastic(E: Tensor, history: History) -> Tensor:
    """E - E_i of the first element."""
    return add(E, scale(-1.0, symmetric(first_components(history, E), E)))


def _rise(x: float) -> float:
    """Integral over s, up to x, of (1 - exp(-s))^2 / x^2."""
    if x < 0.02:  # the differences in the formula below are lost in rounding
        return x * (1.0 / 3.0 - x * (1.0 / 4.0 - x * (7.0 / 60.0 - x / 24.0)))
    faded = -np.expm1(-x)
    return float((x - faded - 0.5 * faded**2) / x**2)


def deviator(E: Tensor) -> Tensor:
    """The components of dev E in the dimensions of E."""
    return add(E, scale(-trace(E) / 3.0, identity(E)))


def deviator_product(A: Tensor, B: Tensor) -> Scalar:
    """dev A : dev B of symmetric tensors in 3D, with missing components 0."""
    return contraction(A, B) - trace(A) * trace(B) / 3.0
