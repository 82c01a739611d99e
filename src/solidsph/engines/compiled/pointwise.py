"""Pointwise functions of parts, compiled.

Parts do not import the compiler: their functions and the helpers that these call are registered
here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

from numba import types
from numba.core.errors import NumbaError
from numba.extending import overload, register_jitable

from solidsph.engines.compiled.jit import njit
from solidsph.errors import PortableError
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Tensor

_DEEPEST = 20  # nested calls; more is taken for a recursion


class NotCompilableError(PortableError):
    """A part cannot be compiled; the caller falls back to arrays."""


def compiled_flux(formulation: Formulation, material: Material, dimension: int) -> Any:
    """Compiled (H, params) -> flux(F(H), P(F)) at one point.

    Raises:
        NotCompilableError: one of their functions cannot be compiled.
    """
    law = _flux(formulation.deformation_gradient, material.first_piola, formulation.flux)
    _try(law, tensor_type(dimension), numbers_type(len(material.params)))
    return law


def compiled_function(function: Callable[..., Any], *arguments: Any) -> Any:
    """A compiled pointwise function, for arguments of these types.

    Raises:
        NotCompilableError: it cannot be compiled.
    """
    call = _call(function)
    _try(call, *arguments)
    return call


def compiled_rate_flux(formulation: Formulation, stress: Any, dimension: int, count: int) -> Any:
    """Compiled (H, dH/dt, params) -> flux(F(H), stress(F, dF/dt, params)) at one point, with
    `count` params.

    Raises:
        NotCompilableError: one of the functions cannot be compiled.
    """
    law = _rate_flux(formulation.deformation_gradient, stress, formulation.flux)
    tensor = tensor_type(dimension)
    _try(law, tensor, tensor, numbers_type(count))
    return law


def compiles(function: Any, *arguments: Any) -> bool:
    """Whether a compiled function compiles for arguments of these types."""
    try:
        _try(function, *arguments)
    except NotCompilableError:
        return False
    return True


def numbers_type(count: int) -> Any:
    """The compiler's type of `params`, and of a vector."""
    return types.UniTuple(types.float64, count)


def tensor_type(dimension: int) -> Any:
    """The compiler's type of a tensor as nested tuples."""
    return types.UniTuple(numbers_type(dimension), dimension)


def _try(function: Any, *arguments: Any) -> None:
    try:
        function.compile(arguments)
    except NumbaError as cause:
        raise NotCompilableError(str(cause)) from cause


@cache
def _call(function: Callable[..., Any]) -> Any:
    return njit(error_model="numpy")(registered(function))


@njit
def no_law(H: Tensor, params: tuple[float, ...]) -> Tensor:
    """H itself, if only the gradient is needed."""
    return H


def number(component: Any) -> float:
    """A component of a tensor as a float: a constant one may be of another type."""
    return float(component)


@overload(number, strict=False)
def _number(component: Any) -> Any:
    return (lambda component: float(component)) if isinstance(component, types.Number) else None


@njit
def numbers(T: Tensor) -> Tensor:
    """The tensor with all components as floats, or as what stands for several of them."""
    if len(T) == 1:
        return ((number(T[0][0]),),)
    if len(T) == 2:
        return ((number(T[0][0]), number(T[0][1])), (number(T[1][0]), number(T[1][1])))
    return (
        (number(T[0][0]), number(T[0][1]), number(T[0][2])),
        (number(T[1][0]), number(T[1][1]), number(T[1][2])),
        (number(T[2][0]), number(T[2][1]), number(T[2][2])),
    )


# Cached by the identity of the functions: a process compiles each combination once.
@cache
def _flux(deformation_gradient: Any, first_piola: Any, flux: Any) -> Any:
    F_of, P_of, T_of = (registered(f) for f in (deformation_gradient, first_piola, flux))

    # Division by zero is infinite or undefined, as for arrays, and no error.
    @njit(error_model="numpy")
    def law(H: Tensor, params: tuple[float, ...]) -> Tensor:
        F = F_of(H)
        return numbers(T_of(F, P_of(F, params)))

    return law


@cache
def _rate_flux(deformation_gradient: Any, stress: Any, flux: Any) -> Any:
    F_of, P_of, T_of = (registered(f) for f in (deformation_gradient, stress, flux))

    @njit(error_model="numpy")
    def law(H: Tensor, rate: Tensor, params: tuple[float, ...]) -> Tensor:
        F = F_of(H)
        return numbers(T_of(F, P_of(F, rate, params)))

    return law


@cache
def registered(function: Callable[..., Any], depth: int = 0) -> Any:
    """The function, registered with the compiler along with every plain function that it calls.

    Raises:
        NotCompilableError: it is not a plain function, or calls itself.
    """
    if not isinstance(function, FunctionType):
        raise NotCompilableError(f"{function!r} is not a plain function")
    if depth > _DEEPEST:
        raise NotCompilableError(f"{function.__qualname__} calls itself, or nests too deeply")
    for helper in _called(function):
        registered(helper, depth + 1)
    return register_jitable(function)


def _called(function: FunctionType) -> Iterator[FunctionType]:
    """Plain functions that a function refers to by name, also in modules."""
    names = set(_names(function.__code__))
    known = [function.__globals__[name] for name in names if name in function.__globals__]
    known += [cell.cell_contents for cell in function.__closure__ or ()]
    for value in known:
        if isinstance(value, FunctionType):
            yield value
        # The compiler knows NumPy's functions.
        elif isinstance(value, ModuleType) and value.__name__.split(".")[0] not in (
            "numpy",
            "math",
        ):
            inside = (vars(value).get(name) for name in names)
            yield from (inner for inner in inside if isinstance(inner, FunctionType))


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
