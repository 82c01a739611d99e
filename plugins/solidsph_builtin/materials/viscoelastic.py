"""Finite linear viscoelasticity: a neo-Hookean spring beside Maxwell elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    add,
    contraction,
    green_lagrange,
    identity,
    product,
    scale,
    trace,
    transpose,
)
from solidsph.registry.parameters import number
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame
from solidsph_builtin.materials._symmetric import (
    component_count,
    components,
    names,
    symmetric,
)
from solidsph_builtin.materials.neo_hookean import NeoHookean

# Plain functions of this module, which is where the compiler looks for them.
_spring_energy = NeoHookean.energy
_spring_stress = NeoHookean.first_piola
_spring_tangent = NeoHookean.tangent


def _elements(given: Any) -> tuple[tuple[float, float], ...]:
    """(share, time [s]) of every element, from what a scene gives."""
    wanted = "viscoelastic: prony takes a list such as [{share = 0.3, time = 0.01}]"
    if isinstance(given, (str, Mapping)) or not isinstance(given, Sequence) or not given:
        raise SceneError(f"{wanted}, got {given!r}; give at least one element")
    found = []
    for element in given:
        named = isinstance(element, Mapping)
        pair = (element.get("share"), element.get("time")) if named else tuple(element)
        if (named and set(element) != {"share", "time"}) or len(pair) != 2:
            raise SceneError(f"{wanted}, got the element {element!r}")
        if not all(isinstance(x, (int, float)) and 0.0 < x < np.inf for x in pair):
            raise SceneError(
                f"{wanted}, got the element {element!r}; both are numbers above 0, time in s"
            )
        found.append((float(pair[0]), float(pair[1])))
    if not sum(share for share, _ in found) < 1.0:
        raise SceneError(
            f"viscoelastic: the shares of prony add up to {sum(s for s, _ in found):.6g}; keep "
            "them below 1; the rest is the long-term part of the shear modulus"
        )
    return tuple(found)


@final
@attrs.frozen
class Viscoelastic(HistoryMaterial):
    """psi = neo-Hookean(lambda, mu_inf) + sum over i of mu_i |dev(E - E_i)|^2.

    The shear modulus relaxes as the Prony series mu(t) = mu_inf + sum mu_i exp(-t / tau_i) with
    mu_i = share_i mu, at constant lambda + 2 mu / 3: only the deviator creeps. E_i is the viscous
    strain of a Maxwell element in the reference configuration, so that the law is objective, with
    dE_i/dt = (E - E_i) / tau_i solved exactly for a strain that changes linearly over the step.
    It dissipates 2 mu_i |dev(E - E_i)|^2 / tau_i. Simo & Hughes (1998), chapter 10, with the
    energy of the elements written out.
    """

    prony: Sequence[Any] = attrs.field(converter=_elements)  # (share [-], time [s]) of elements
    youngs_modulus: float = number()  # instantaneous, E [Pa]
    poissons_ratio: float = number()  # instantaneous, nu [-]
    density: float = number()  # rho_0 [kg/m^3]

    example: ClassVar[Mapping[str, Any]] = {
        **RUBBER,
        "prony": [{"share": 0.4, "time": 1e-2}, {"share": 0.2, "time": 1.0}],  # [-], [s]
    }

    rate_dependent: ClassVar[bool] = True

    def __attrs_post_init__(self) -> None:
        check_elastic("viscoelastic", self)

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        """lambda and mu of the neo-Hookean part, then mu_i and tau_i of every element."""
        lam, mu = self.lame_parameters
        relaxing = mu * sum(share for share, _ in self.prony)
        elements = (x for share, time in self.prony for x in (mu * share, time))
        return (lam + 2.0 / 3.0 * relaxing, mu - relaxing, *elements)

    def initial_history(self, dimension: int) -> Mapping[str, float]:
        strains = {
            f"viscous strain {i + 1} {name} [-]": 0.0
            for i in range(len(self.prony))
            for name in names(dimension)
        }
        before = {f"strain before {name} [-]": 0.0 for name in names(dimension)}
        return {**strains, **before, "dissipated energy [J/m^3]": 0.0}

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        E, psi = green_lagrange(F), _spring_energy(F, params[:2])
        for i in range(2, len(params), 2):
            psi = psi + params[i] * _deviator_product(E, E)
        return psi

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        E, P = green_lagrange(F), _spring_stress(F, params[:2])
        for i in range(2, len(params), 2):
            P = add(P, product(F, scale(2.0 * params[i], _deviator(E))))
        return P

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        E, dP = green_lagrange(F), _spring_tangent(F, dF, params[:2])
        half = product(transpose(F), dF)
        dE = scale(0.5, add(half, transpose(half)))
        for i in range(2, len(params), 2):
            along = add(product(dF, _deviator(E)), product(F, _deviator(dE)))
            dP = add(dP, scale(2.0 * params[i], along))
        return dP

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        E, d = green_lagrange(F), len(F)
        size = component_count(d)
        count = (len(params) - 2) // 2
        before = symmetric(history[count * size : (count + 1) * size], d)
        change = add(E, scale(-1.0, before))
        kept: History = ()
        lost = history[-1]
        for i in range(count):
            mu, x = params[2 + 2 * i], step / params[3 + 2 * i]
            faded = -np.expm1(-x)
            strain = symmetric(history[i * size : (i + 1) * size], d)
            # E is linear over the step: q = E - E_i, at a part s of tau after its beginning, is
            # q_0 exp(-s) + (1 - exp(-s)) change / x, and 2 mu |dev q|^2 is integrated over s.
            q = add(before, scale(-1.0, strain))
            lost = lost + 2.0 * mu * (
                0.5 * faded * (2.0 - faded) * _deviator_product(q, q)
                + faded**2 / x * _deviator_product(q, change)
                + _rise(x) * _deviator_product(change, change)
            )
            q = add(scale(1.0 - faded, q), scale(faded / x, change))
            kept = kept + components(add(E, scale(-1.0, q)))
        return (*kept, *components(E), lost)

    @staticmethod
    def stored(F: Tensor, history: History, params: tuple[float, ...]) -> Scalar:
        E, d = green_lagrange(F), len(F)
        size = component_count(d)
        psi = _spring_energy(F, params[:2])
        for i in range((len(params) - 2) // 2):
            strain = symmetric(history[i * size : (i + 1) * size], d)
            e = add(E, scale(-1.0, strain))
            psi = psi + params[2 + 2 * i] * _deviator_product(e, e)
        return psi

    @staticmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        E, d = green_lagrange(F), len(F)
        size = component_count(d)
        P = _spring_stress(F, params[:2])
        for i in range((len(params) - 2) // 2):
            strain = symmetric(history[i * size : (i + 1) * size], d)
            overstress = _deviator(add(E, scale(-1.0, strain)))
            P = add(P, product(F, scale(2.0 * params[2 + 2 * i], overstress)))
        return P

    @staticmethod
    def dissipated(history: History) -> Scalar:
        return history[-1]


def _rise(x: float) -> float:
    """Integral over s, up to x, of (1 - exp(-s))^2 / x^2."""
    if x < 0.02:  # the differences in the formula below are lost in rounding
        return x * (1.0 / 3.0 - x * (1.0 / 4.0 - x * (7.0 / 60.0 - x / 24.0)))
    faded = -np.expm1(-x)
    return float((x - faded - 0.5 * faded**2) / x**2)


def _deviator(E: Tensor) -> Tensor:
    """The components of dev E in the dimensions of E."""
    return add(E, scale(-trace(E) / 3.0, identity(E)))


def _deviator_product(A: Tensor, B: Tensor) -> Scalar:
    """dev A : dev B of symmetric tensors in 3D, with missing components 0."""
    return contraction(A, B) - trace(A) * trace(B) / 3.0
