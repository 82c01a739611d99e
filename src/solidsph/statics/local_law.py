"""LocalLaw: stress and moduli of the particles of a body, at the end of a load step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.array_law import ArrayLaw
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import Law
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first
from solidsph.statics.increment import AT_REST, Increment

# Change of F for a difference quotient [-], small beside a strain of first yield: particles that
# begin to flow within it have neither the moduli before nor those after. Rounding leaves 1e-9.
_CHANGE = 1e-7


class LocalLaw(ABC):
    """First Piola-Kirchhoff stress as a function of F, for all particles of a body."""

    smooth: ClassVar[bool]
    """False if the moduli may change at once, as where a metal begins to flow."""

    @abstractmethod
    def during(self, increment: Increment) -> LocalLaw:
        """The law at the end of another load step."""

    @abstractmethod
    def stress(self, F: Array) -> Array:
        """P (n, d, d) [Pa] at F (n, d, d)."""

    @abstractmethod
    def change(self, F: Array, dF: Array) -> Array:
        """dP (n, d, d) [Pa], linear in dF (n, d, d)."""

    def moduli(self, F: Array) -> Array:
        """dP_ik / dF_jl, (n, d, d, d, d) [Pa]."""
        n, d = F.shape[:2]
        moduli = np.empty((n, d, d, d, d))
        for j in range(d):
            for k in range(d):
                dF = np.zeros((d, d))
                dF[j, k] = 1.0
                moduli[..., j, k] = self.change(F, np.broadcast_to(dF, F.shape))
        return moduli


@final
@attrs.frozen(eq=False)
class _Elastic(LocalLaw):
    """The law of a material without history, and its derivative by the material itself."""

    smooth: ClassVar[bool] = True

    body: Body

    def during(self, increment: Increment) -> LocalLaw:
        return self

    def stress(self, F: Array) -> Array:
        material = self.body.material
        return particles_first(material.first_piola(components_first(F), material.params), len(F))

    def change(self, F: Array, dF: Array) -> Array:
        material = self.body.material
        dP = material.tangent(components_first(F), components_first(dF), material.params)
        return particles_first(dP, len(F))


@final
@attrs.frozen(eq=False)
class _Remembering(LocalLaw):
    """A law with internal variables, which a load step advances; derivatives are differences.

    They are those of the stress after the step, the consistent moduli of Simo & Taylor (1985).
    """

    smooth: ClassVar[bool] = False

    law: Law
    history: Array  # (n, k) at the beginning of the step
    step: float  # [s]

    def during(self, increment: Increment) -> LocalLaw:
        return attrs.evolve(
            self, history=self.law.history_of(increment.memory), step=increment.step
        )

    def stress(self, F: Array) -> Array:
        flux, _ = self.law.flux(F - np.eye(F.shape[1]), self.history, self.step)
        return np.moveaxis(flux, -1, 0)

    def change(self, F: Array, dF: Array) -> Array:
        size = np.linalg.norm(dF, axis=(-2, -1), keepdims=True)
        unit = _CHANGE * dF / np.where(size > 0.0, size, 1.0)
        difference = self.stress(F + unit) - self.stress(F - unit)
        return np.asarray(difference * size / (2.0 * _CHANGE))

    def moduli(self, F: Array) -> Array:
        n, d = F.shape[:2]
        moduli = super().moduli(F).reshape(n, d * d, d * d)
        # The solvers need an energy, which flow has unless it heats or is not associated.
        return (0.5 * (moduli + moduli.transpose(0, 2, 1))).reshape(n, d, d, d, d)


def local_law(body: Body, sums: InternalForces) -> LocalLaw:
    """The law of a body whose forces are `sums`, at rest."""
    if not isinstance(body.material, HistoryMaterial):
        return _Elastic(body)
    law = sums.law(body) or ArrayLaw(body)
    return _Remembering(law, law.history_of(AT_REST.memory), AT_REST.step)
