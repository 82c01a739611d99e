"""Adaptive damping that brings a body to rest fastest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import Load, Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.registry.parameters import number
from solidsph.run.cfl_step import lattice_frequency

# Largest damping rate, relative to the highest frequency of a lattice: no relevant motion is that
# fast, and the rate costs at most a tenth of the time step.
_CAP = 0.1


@final
@attrs.frozen
class DynamicRelaxation(Effect):
    """f = -2 damping w m v, with w the frequency of the current motion: critical by default.

    After Underwood (1983). The frequency is the Rayleigh quotient of the displacement,

        w^2 = -(u . m a) / (u . m u),

    with u and a the changes of position and of acceleration, without this damping, since the first
    step: -m a is the stiffness times u if the loads are constant. The displacement soon resembles
    that of the equilibrium, in which slow motions dominate. No stiffness matrix is needed, and the
    equilibrium does not depend on the rate. It does not work for a body that is not held, and for
    an equilibrium alone [statics] is faster.
    """

    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.REST})

    damping: float = number(default=1.0)  # [-] times critical

    def __attrs_post_init__(self) -> None:
        if not 0.0 < self.damping <= 10.0:
            raise SceneError(
                f"dynamic-relaxation: damping must lie between 0 and 10, got {self.damping}; 1 is "
                "critical"
            )

    def bind(self, model: DiscreteModel, label: str) -> Load:
        return _Relaxation(
            label=label,
            masses=np.repeat(model.masses[:, None], model.particles.dimension, axis=1),
            damping=self.damping,
            damping_rate=_CAP * lattice_frequency(model.bodies),
        )


@final
@attrs.frozen(eq=False)
class _Relaxation(Load):
    label: str
    masses: Array  # (n, d), of a particle for each axis: products of whole arrays are quicker [kg]
    damping: float
    damping_rate: float  # largest [1/s]

    @property
    def arrays(self) -> Mapping[str, int]:
        size = self.masses.nbytes
        return {"masses": size, "first step": 2 * size, "last velocity": size}

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.masses))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.zeros_like(velocities)  # before the first step the motion is not known

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        last, rate = (memory.get(self._named(name)) for name in ("last velocity", "rate"))
        c = 0.0 if rate is None else float(rate[0])
        if step == 0.0:
            kept = {}
        elif last is None:
            kept = {self._named("last velocity"): velocities}
        else:
            first = memory.get(self._named("first position"), positions)
            change = velocities - last
            # The acceleration by all other forces, without the part of this damping, is
            # change / step + c velocities.
            first_acceleration = memory.get(self._named("first acceleration"))
            if first_acceleration is None:
                first_acceleration = change / step + c * velocities
            way = positions - first
            weighted = self.masses * way
            power = _product(weighted, change) / step + c * _product(weighted, velocities)
            power -= _product(weighted, first_acceleration)
            c = self._rate(_product(weighted, way), power, c)
            kept = {
                self._named("first position"): first,
                self._named("first acceleration"): first_acceleration,
                self._named("last velocity"): velocities,
                self._named("rate"): np.array([c]),
            }
        force = self.masses * velocities
        force *= -c
        return force, kept

    def _named(self, name: str) -> str:
        return f"{self.label}: {name}"

    def _rate(self, weight: float, power: float, c: float) -> float:
        # The rate is kept before the first motion and while a load drives the body on.
        if not (weight > 0.0 and power < 0.0):
            return c
        return min(2.0 * self.damping * float(np.sqrt(-power / weight)), self.damping_rate)

    def report(self, observation: Observation) -> Mapping[str, float]:
        rate = observation.state.memory.get(self._named("rate"), np.zeros(1))
        return {f"{self.label} rate [1/s]": float(rate[0])}


def _product(a: Array, b: Array) -> float:
    """Sum of the products of all numbers."""
    return float(np.einsum("i,i->", a.ravel(), b.ravel()))
