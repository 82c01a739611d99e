"""Material damping in proportion to stiffness and strain rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import RateStressLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array, Tensor
from solidsph.maths.tensors import add, identity, product, scale, trace, transpose
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.effects._gradients import BodyGradient, in_the_reference

# Largest number of freedoms for a dense eigenvalue problem, and the relative tolerance beyond.
_DENSE, _FOUND = 60, 1e-3


@final
@attrs.frozen
class KelvinVoigt(Effect):
    """A dashpot beside the material: S_v = time (lambda tr(dE/dt) I + 2 mu dE/dt), P_v = F S_v.

    The Kelvin-Voigt solid in the reference configuration, with E the Green-Lagrange strain: it is
    objective, rigid motions give no stress, and energy is only dissipated. A small vibration of
    angular frequency w decays as exp(-time w^2 t / 2): the stiffness-proportional term of Rayleigh
    damping, which damps short waves first. Gradient and divergence are those of the material.
    """

    conserves_momentum: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.REST})
    uses_initial_pairs: ClassVar[bool] = True

    time: float = number()  # retardation time [s]

    example: ClassVar[Mapping[str, Any]] = {"time": 1e-5}

    def __attrs_post_init__(self) -> None:
        check_positive("kelvin-voigt", "time", self.time, "s, or leave the effect out")

    def bind(self, model: DiscreteModel, label: str) -> Load:
        in_the_reference(model, "kelvin-voigt")
        gradients = [BodyGradient.of(body) for body in model.bodies]
        return _Dashpot(
            label=label,
            reference=model.particles.positions,
            time=self.time,
            sums=gradients,
            damping_rate=self.time * max(_highest_square(gradient) for gradient in gradients),
        )

    def pair_work(self, particles: float, pairs: float) -> float:
        return 3.0 * pairs  # both gradients, and the divergence


def _highest_square(gradient: BodyGradient) -> float:
    """Largest square of an angular frequency of a body's linear stiffness [1/s^2]."""
    body, real = gradient.body, ~gradient.body.particles.ghosts
    n, d = body.particles.positions.shape
    roots = np.zeros((n, 1))
    roots[real, 0] = 1.0 / np.sqrt(body.masses[real])

    def stiffness(flat: Array) -> Array:
        rate = gradient.gradient(roots * flat.reshape(n, d))
        symmetric = 0.5 * (rate + rate.transpose(1, 0, 2))
        stress = _viscous_stress(symmetric, body.material.lame_parameters)
        return -(roots * gradient.forces(np.array(stress))).ravel()

    whole = LinearOperator((n * d, n * d), matvec=stiffness, dtype=np.float64)
    if n * d <= _DENSE:
        dense = np.column_stack([stiffness(column) for column in np.eye(n * d)])
        return float(np.linalg.eigvalsh(0.5 * (dense + dense.T))[-1])
    start = np.random.default_rng(0).normal(size=n * d)
    highest = eigsh(whole, k=1, which="LA", tol=_FOUND, v0=start, return_eigenvectors=False)
    return float(highest[0] * (1.0 + _FOUND))


def _viscous_stress(rate: Tensor, params: tuple[float, ...]) -> Tensor:
    """lambda tr(dE/dt) I + 2 mu dE/dt, for lambda and mu, or both times a time."""
    return add(scale(params[0] * trace(rate), identity(rate)), scale(2.0 * params[1], rate))


@final
@attrs.frozen(eq=False)
class _Dashpot(RateStressLoad):
    label: str
    reference: Array  # X (n, d)
    time: float
    sums: Sequence[BodyGradient]
    damping_rate: float  # [1/s]

    def params_of(self, body: Body) -> tuple[float, ...]:
        """lambda and mu times the retardation time [Pa s]."""
        lam, mu = body.material.lame_parameters
        return self.time * lam, self.time * mu

    @staticmethod
    def stress(F: Tensor, rate: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), rate)
        return product(F, _viscous_stress(scale(0.5, add(half, transpose(half))), params))

    @property
    def arrays(self) -> Mapping[str, int]:
        return {f"gradient of {g.body.name}": g.matrices.bytes for g in self.sums}
