"""Finite linear viscoelasticity: a neo-Hookean spring beside Maxwell elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, Protocol, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import LOGARITHMIC, Dilatation
from solidsph.maths.tensors import (
    add,
    green_lagrange,
    product,
    scale,
    transpose,
)
from solidsph.registry.parameters import number
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame
from solidsph_builtin.materials._maxwell import (
    after,
    creep,
    deviator,
    deviator_product,
    element_energy,
    overstress,
)
from solidsph_builtin.materials._symmetric import (
    components,
    first_components,
    later,
    names,
    symmetric,
)
from solidsph_builtin.materials.neo_hookean import NeoHookean

# Plain functions of this module, which is where the compiler looks for them.
_spring_energy = NeoHookean.energy
_spring_stress = NeoHookean.first_piola
_spring_tangent = NeoHookean.tangent


class _Advance(Protocol):
    def __call__(
        self, F: Tensor, history: History, step: float, params: tuple[float, ...]
    ) -> History: ...


class _Stress(Protocol):
    def __call__(self, F: Tensor, history: History, params: tuple[float, ...]) -> Tensor: ...


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

    dilatation: ClassVar[Dilatation | None] = LOGARITHMIC
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
            psi = psi + params[i] * deviator_product(E, E)
        return psi

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        E, P = green_lagrange(F), _spring_stress(F, params[:2])
        for i in range(2, len(params), 2):
            P = add(P, product(F, scale(2.0 * params[i], deviator(E))))
        return P

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        E, dP = green_lagrange(F), _spring_tangent(F, dF, params[:2])
        half = product(transpose(F), dF)
        dE = scale(0.5, add(half, transpose(half)))
        for i in range(2, len(params), 2):
            along = add(product(dF, deviator(E)), product(F, deviator(dE)))
            dP = add(dP, scale(2.0 * params[i], along))
        return dP

    @property
    def advance(self) -> _Advance:
        return advance_of(len(self.prony))

    @staticmethod
    def stored(F: Tensor, history: History, params: tuple[float, ...]) -> Scalar:
        E, psi, rest = green_lagrange(F), _spring_energy(F, params[:2]), history
        for i in range(2, len(params), 2):
            psi = psi + element_energy(E, rest, params[i : i + 2])
            rest = later(rest, E)
        return psi

    @property
    def stress(self) -> _Stress:
        return stress_of(len(self.prony))

    @staticmethod
    def dissipated(history: History) -> Scalar:
        return history[-1]


@cache
def advance_of(count: int) -> _Advance:
    """`Viscoelastic.advance` for this number of elements."""
    crept, others = creep(count), after(count)

    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        E = green_lagrange(F)
        before = symmetric(first_components(others(history, F), F), F)
        change = add(E, scale(-1.0, before))
        strains, lost = crept(E, before, change, history, step, params[2:])
        return strains + components(E) + (history[-1] + lost,)

    return advance


@cache
def stress_of(count: int) -> _Stress:
    """`Viscoelastic.stress` for this number of elements."""
    beyond = overstress(count)

    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        S = beyond(green_lagrange(F), history, params[2:])
        return add(_spring_stress(F, params[:2]), product(F, S))

    return stress
