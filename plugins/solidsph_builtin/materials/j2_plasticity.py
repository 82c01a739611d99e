"""Metal plasticity: von Mises' yield stress with linear and saturating hardening."""

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
    ROUNDING,
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

# Newton's method from the trial state decreases monotonically, since the slope of hardening never
# rises. Two steps suffice for linear hardening, six for saturation at some per cent of strain a
# step.
_STEPS = 6


@final
@attrs.frozen
class J2Plasticity(HistoryMaterial):
    """psi = kappa/2 ((J^2 - 1)/2 - ln J) + mu/2 (J^(-2/3) C : C_p^-1 - 3), with det C_p = 1.

    Multiplicative J2 flow with isotropic hardening, Simo (1988), Simo & Hughes (1998), chapter 9:
    the equivalent Kirchhoff stress stays within

        yield + (saturation - yield) (1 - exp(-exponent e)) + hardening e,

    e the equivalent plastic strain. A step is a radial return that keeps det C_p = 1
    (`materials/_flow.py`), solved to rounding.

    All plastic work counts as dissipated: unloading does not return what hardening stores in the
    crystal.
    """

    youngs_modulus: float = number()  # E [Pa]
    poissons_ratio: float = number()  # nu [-]
    density: float = number()  # rho_0 [kg/m^3]
    yield_stress: float = number()  # [Pa]
    hardening: float = number(default=0.0)  # slope over the plastic strain [Pa]
    saturation_stress: float = number(default=0.0)  # [Pa]; 0 for no saturation
    saturation_exponent: float = number(default=1.0)  # [-]

    # The conformance kit strains by ten times the strain of first yield and more.
    dilatation: ClassVar[Dilatation | None] = POWER
    example: ClassVar[Mapping[str, Any]] = {
        **RUBBER,
        "yield_stress": 1e4,
        "hardening": 2e4,
        "saturation_stress": 1.5e4,
        "saturation_exponent": 20.0,
    }

    shown: ClassVar[Sequence[str]] = (PLASTIC_STRAIN,)

    def __attrs_post_init__(self) -> None:
        law = "material 'j2-plasticity'"
        check_elastic("j2-plasticity", self)
        check_positive(law, "yield_stress", self.yield_stress, "Pa")
        check_positive(law, "saturation_exponent", self.saturation_exponent, "1")
        if not 0.0 <= self.hardening < 1e100:
            raise SceneError(
                f"{law}: hardening must not be negative, got {self.hardening}; under a softening "
                "law deformation localises to a width that the spacing decides"
            )
        if self.saturation_stress and not self.yield_stress <= self.saturation_stress < 1e100:
            raise SceneError(
                f"{law}: saturation_stress must be at least the yield stress of "
                f"{self.yield_stress:g} Pa, got {self.saturation_stress}; leave it out for none"
            )

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        """kappa, mu, then yield stress, rise to saturation, its exponent, slope."""
        lam, mu = self.lame_parameters
        rise = self.saturation_stress - self.yield_stress if self.saturation_stress else 0.0
        hardening = (rise, self.saturation_exponent, self.hardening)
        return (lam + 2.0 / 3.0 * mu, mu, self.yield_stress, *hardening)

    def initial_history(self, dimension: int) -> Mapping[str, float]:
        return _plastic.initial_history(dimension, {})

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
        e_before, lost = history[size], history[size + 1]
        b = elastic_metric(wide, G)
        trial = deviator_length(b)
        det_n = direction_determinant(b, trial)
        least = ROOT * _flow_stress(e_before, params) / mu
        if not np.any(trial > least):
            return history
        x = trial
        for _ in range(_STEPS):
            share = strain_of_flow(x, trial, det_n)
            e = e_before + share * (trial - x)
            miss = mu * x - ROOT * _flow_stress(e, params)
            before = x
            x = x - miss / (mu + ROOT * share * _slope(e, params))
            x = np.minimum(np.maximum(x, least), trial)
            if not np.any(np.abs(x - before) > ROUNDING * trial):
                break
        flows = 1.0 * (trial > least)
        e = e_before + flows * strain_of_flow(x, trial, det_n) * (trial - x)
        after = components(narrowed(flowed(wide, G, b, x, trial, det_n), F))
        work = _plastic_work(e, params) - _plastic_work(e_before, params)
        # A sum of tuples: unpacking does not compile.
        return chosen(flows, after, history) + (e, lost + work)  # noqa: RUF005


def _flow_stress(e: Scalar, params: tuple[float, ...]) -> Scalar:
    """Equivalent stress of flow at the plastic strain e [Pa]."""
    first, rise, exponent, slope = params[2:]
    return first - rise * np.expm1(-exponent * e) + slope * e


def _slope(e: Scalar, params: tuple[float, ...]) -> Scalar:
    """Its derivative."""
    return params[3] * params[4] * np.exp(-params[4] * e) + params[5]


def _plastic_work(e: Scalar, params: tuple[float, ...]) -> Scalar:
    """Its integral from 0 to e [J/m^3]."""
    first, rise, exponent, slope = params[2:]
    saturating = rise * (e + np.expm1(-exponent * e) / exponent)
    return first * e + saturating + 0.5 * slope * e**2
