"""The elastic energy and the history that the laws of plastic metals share.

psi = kappa/2 ((J^2 - 1)/2 - ln J) + mu/2 (J^(-2/3) C : C_p^-1 - 3), with det C_p = 1. The
history is C_p^-1, the plastic strain, whatever a law adds, and the dissipated energy; the
parameters begin with kappa and mu.
"""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.interfaces.history import History
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import identity
from solidsph_builtin.materials._flow import metric
from solidsph_builtin.materials._isochoric import energy_of, stress_of, tangent_of
from solidsph_builtin.materials._symmetric import component_count, components, names
from solidsph_builtin.materials._wide import narrowed, widened, widened_change

PLASTIC_STRAIN = "plastic strain [-]"


def initial_history(dimension: int, added: Mapping[str, float]) -> Mapping[str, float]:
    """Internal variables of a metal that has not yielded yet, with those that a law has added."""
    diagonal = {"xx": 1.0, "yy": 1.0, "zz": 1.0}
    inverse = {f"inverse plastic metric {a} [-]": diagonal.get(a, 0.0) for a in names(dimension)}
    return {**inverse, PLASTIC_STRAIN: 0.0, **added, "dissipated energy [J/m^3]": 0.0}


def history_in_space(history: History, dimension: int) -> History:
    """Internal variables in three dimensions; det C_p = 1 gives the metric across."""
    like = ((0.0,) * dimension,) * dimension
    return (*components(metric(history, like)), *history[component_count(dimension) :])


def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
    """psi(F) before any flow."""
    wide = widened(F)
    return energy_of(wide, identity(wide), params[0], params[1])


def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
    """P(F) before any flow."""
    wide = widened(F)
    return narrowed(stress_of(wide, identity(wide), params[0], params[1]), F)


def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
    """Change of P along a change of F, before any flow."""
    return narrowed(tangent_of(widened(F), widened_change(dF), params[0], params[1]), F)


def stored(F: Tensor, history: History, params: tuple[float, ...]) -> Scalar:
    """psi(F, C_p^-1)."""
    return energy_of(widened(F), metric(history, F), params[0], params[1])


def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
    """P = dpsi/dF at fixed C_p^-1."""
    return narrowed(stress_of(widened(F), metric(history, F), params[0], params[1]), F)


def dissipated(history: History) -> Scalar:
    """The last of the internal variables."""
    return history[-1]
