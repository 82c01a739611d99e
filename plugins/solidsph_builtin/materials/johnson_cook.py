"""Metal plasticity at high rates: yield stress by strain, rate and temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import POWER, Dilatation
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.materials import _plastic
from solidsph_builtin.materials._flow import (
    ROOT,
    chosen,
    deviator_length,
    direction_determinant,
    elastic_metric,
    flowed,
    metric,
    strain_of_flow,
)
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame
from solidsph_builtin.materials._plastic import PLASTIC_STRAIN
from solidsph_builtin.materials._symmetric import component_count, components
from solidsph_builtin.materials._wide import narrowed, widened

TEMPERATURE = "temperature [K]"

# Newton's method for the logarithm of the decrease of x, in which the flow stress is nearly linear
# at high rates. The residual is concave, so that the iteration is monotonic from a decrease that is
# too large. Twelve steps reach rounding for strains of up to a per cent in a step.
_STEPS = 12

# Relative change from which the next is rounding: each is a thousandth of the last or less.
_CLOSE = 1e-12

# Slopes of powers below 1, and logarithms, have no value at zero.
_SMALLEST = 1e-30


@final
@attrs.frozen
class JohnsonCook(HistoryMaterial):
    """The elastic energy of `j2-plasticity`, and the flow stress of Johnson & Cook (1983):

        (yield + B e^n) (1 + C ln(e' / reference rate)) (1 - T*^m),
        T* = (T - reference) / (melting - reference), within 0 and 1,

    e the equivalent plastic strain, e' its rate; below the reference rate the logarithm is 0.
    Heating is adiabatic: rho_0 c dT = heat_share times the plastic work (Taylor & Quinney, 1934),
    all of which counts as dissipated. A step is the radial return of `materials/_flow.py` to the
    flow stress at the rate and the temperature of its end.
    """

    youngs_modulus: float = number()  # E [Pa]
    poissons_ratio: float = number()  # nu [-]
    density: float = number()  # rho_0 [kg/m^3]
    yield_stress: float = number()  # A [Pa]
    hardening_modulus: float = number()  # B [Pa]
    hardening_exponent: float = number()  # n [-]
    rate_coefficient: float = number()  # C [-]
    softening_exponent: float = number()  # m [-]
    melting_temperature: float = number()  # [K]
    specific_heat: float = number()  # c [J/(kg K)]
    reference_rate: float = number(default=1.0)  # [1/s]
    reference_temperature: float = number(default=293.0)  # [K]
    temperature: float = number(default=293.0)  # at the start [K]
    heat_share: float = number(default=0.9)  # of the plastic work [-]

    dilatation: ClassVar[Dilatation | None] = POWER
    example: ClassVar[Mapping[str, Any]] = {
        **RUBBER,
        "yield_stress": 1e4,
        "hardening_modulus": 2e4,
        "hardening_exponent": 0.3,
        "rate_coefficient": 0.02,
        "softening_exponent": 1.1,
        "melting_temperature": 500.0,
        "specific_heat": 0.1,  # small, so that such a soft solid warms up
    }

    shown: ClassVar[Sequence[str]] = (PLASTIC_STRAIN, TEMPERATURE)
    rate_dependent: ClassVar[bool] = True

    def __attrs_post_init__(self) -> None:
        law = "material 'johnson-cook'"
        check_elastic("johnson-cook", self)
        for name, unit in (
            ("yield_stress", "Pa"),
            ("hardening_exponent", "1"),
            ("softening_exponent", "1"),
            ("specific_heat", "J/(kg K)"),
            ("reference_rate", "1/s"),
            ("reference_temperature", "K"),
            ("temperature", "K"),
        ):
            check_positive(law, name, getattr(self, name), unit)
        for name in ("hardening_modulus", "rate_coefficient"):
            value = getattr(self, name)
            if not 0.0 <= value < 1e100:
                raise SceneError(f"{law}: {name} must not be negative, got {value}; 0 is none")
        if not self.reference_temperature < self.melting_temperature < 1e100:
            raise SceneError(
                f"{law}: melting_temperature must be above the reference temperature of "
                f"{self.reference_temperature:g} K, got {self.melting_temperature}; give both in K"
            )
        if not 0.0 <= self.heat_share <= 1.0:
            raise SceneError(
                f"{law}: heat_share must lie between 0 and 1, got {self.heat_share}; 0.9 is usual"
            )

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        """kappa, mu, A, B, n, C, m, reference rate, reference and melting temperature, dT over
        plastic work."""
        lam, mu = self.lame_parameters
        return (
            lam + 2.0 / 3.0 * mu,
            mu,
            self.yield_stress,
            self.hardening_modulus,
            self.hardening_exponent,
            self.rate_coefficient,
            self.softening_exponent,
            self.reference_rate,
            self.reference_temperature,
            self.melting_temperature,
            self.heat_share / (self.density * self.specific_heat),
        )

    def initial_history(self, dimension: int) -> Mapping[str, float]:
        return _plastic.initial_history(dimension, {TEMPERATURE: self.temperature})

    def history_in_space(self, history: History, dimension: int) -> History:
        return _plastic.history_in_space(history, dimension)

    energy = staticmethod(_plastic.energy)
    first_piola = staticmethod(_plastic.first_piola)
    tangent = staticmethod(_plastic.tangent)
    stored = staticmethod(_plastic.stored)
    stress = staticmethod(_plastic.stress)
    dissipated = staticmethod(_plastic.dissipated)

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        mu, size = params[1], component_count(len(F))
        wide, G = widened(F), metric(history, F)
        e, T, lost = history[size], history[size + 1], history[size + 2]
        b = elastic_metric(wide, G)
        trial = deviator_length(b)
        det_n = direction_determinant(b, trial)
        power, cold = e ** params[4], _of_temperature(T, params)
        begin = ROOT * (params[2] + params[3] * power) * cold / mu
        if not np.any(trial > begin):
            return history
        fall = np.maximum(trial - begin, _SMALLEST)
        for _ in range(_STEPS):
            share = strain_of_flow(trial - fall, trial, det_n)
            _, stress, by_strain = _flow(e, power, share * fall, T, cold, step, params)
            miss, slope = mu * (trial - fall) - ROOT * stress, mu + ROOT * share * by_strain
            before = fall
            longer = fall * np.exp(miss / (slope * fall))
            fall = np.maximum(np.minimum(longer, trial), _SMALLEST)
            if not np.any(np.abs(fall - before) > _CLOSE * fall):
                break
        flows, x = 1.0 * (trial > begin), trial - fall
        added = flows * strain_of_flow(x, trial, det_n) * fall
        work, _, _ = _flow(e, power, added, T, cold, step, params)
        G_after = components(narrowed(flowed(wide, G, b, x, trial, det_n), F))
        G_kept = chosen(flows, G_after, history)
        # A sum of tuples: unpacking does not compile.
        return G_kept + (e + added, T + params[10] * work, lost + work)  # noqa: RUF005


def _of_temperature(T: Scalar, params: tuple[float, ...]) -> Scalar:
    """1 - T*^m."""
    return 1.0 - _homologous(T, params) ** params[6]


def _homologous(T: Scalar, params: tuple[float, ...]) -> Scalar:
    """T*."""
    share = (T - params[8]) / (params[9] - params[8])
    return np.minimum(np.maximum(share, 0.0), 1.0)


def _flow(
    e: Scalar,
    power: Scalar,
    added: Scalar,
    T: Scalar,
    cold: Scalar,
    step: float,
    params: tuple[float, ...],
) -> tuple[Scalar, Scalar, Scalar]:
    """Plastic work [J/m^3] of a step with `added` strain, stress of flow at its end, and the
    derivative of that by the strain added [Pa].

    The step begins at e and T, with e^n in `power` and 1 - T*^m in `cold`. Hardening is integrated,
    heat taken at half of the step. All in one function, as powers and logarithms are what costs.
    """
    total = e + added
    end_power = total ** params[4]
    hardened = params[2] + params[3] * end_power
    of_rate = 1.0 + params[5] * np.log(np.maximum(added / (step * params[7]), 1.0))
    rise = params[3] / (params[4] + 1.0) * (end_power * total - power * e)
    work = (params[2] * added + rise) * of_rate
    work = work * _of_temperature(T + 0.5 * params[10] * work * cold, params)
    warm = _homologous(T + params[10] * work, params)
    lost = warm ** params[6]
    stress = hardened * of_rate * (1.0 - lost)
    fast = 1.0 * (added > step * params[7])
    by_rate = fast * params[5] / np.maximum(added, _SMALLEST)
    by_hardening = params[3] * params[4] * end_power / np.maximum(total, _SMALLEST)
    softening = params[6] * lost / np.maximum(warm, _SMALLEST) / (params[9] - params[8])
    slope = (by_hardening * of_rate + hardened * by_rate) * (1.0 - lost)
    return work, stress, slope - hardened * of_rate * softening * params[10] * stress
