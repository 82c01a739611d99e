"""Parts that are wrong in one respect each, and scenes with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from solidsph import Discretisation, Effect, Particles, Shape
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import EnergyTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices, Tensor
from solidsph.maths.tensors import scale
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.integrators.velocity_verlet import VelocityVerlet
from solidsph_builtin.materials.neo_hookean import NeoHookean
from tests.helpers.scenes import box


@attrs.frozen(eq=False)
class Springs(EnergyTerm, Load):
    """A bed of springs: f = -k u."""

    label: str
    indices: Indices
    origin: Array
    stiffness: float
    damping_rate: Any = 0.0
    stiffness_rate: float = 0.0

    @property
    def particles(self) -> Indices:
        return self.indices

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -self.stiffness * (positions - self.origin)[self.indices]

    def energies(self, observation: Observation) -> Array:
        u = observation.state.positions - self.origin
        return np.asarray(0.5 * self.stiffness * np.sum(u**2, axis=1))

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


class HalfOfIt(Springs):
    def energies(self, observation: Observation) -> Array:
        return 0.5 * super().energies(observation)


class OneForAll(Springs):
    def energies(self, observation: Observation) -> Any:
        return super().energies(observation).sum()


class Broadcast(Springs):
    """One force, which fits any number of particles."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.zeros(positions.shape[1])


class NoNumber(Springs):
    def report(self, observation: Observation) -> Mapping[str, float]:
        return {f"{self.label} extension [m]": float("nan")}


class Writes(Springs):
    def report(self, observation: Observation) -> Mapping[str, float]:
        observation.state.positions[:] += 1e-3
        return {}


class WritesMasses(Springs):
    def report(self, observation: Observation) -> Mapping[str, float]:
        observation.masses[:] *= 2.0
        return {}


class Fails(Springs):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        if time > 1e-3:
            raise ZeroDivisionError("a spring is of no length")
        return super().forces(time, positions, velocities)


@attrs.frozen
class Bed(Effect):
    """Springs between every particle and where it was."""

    kind: type[Springs] = Springs
    stiffness: float = 1e3  # [N/m]
    damping: Any = 0.0
    declared: float = 1.0  # of the frequency that is true

    def bind(self, model: DiscreteModel, label: str) -> Load:
        X = model.particles.positions
        lightest = model.masses[model.masses > 0.0].min()
        return self.kind(
            label=label,
            indices=np.arange(len(X)),
            origin=X,
            stiffness=self.stiffness,
            damping_rate=self.damping,
            stiffness_rate=self.declared * float(np.sqrt(self.stiffness / lightest)),
        )


class BindsNothing(Bed):
    def bind(self, model: DiscreteModel, label: str) -> Any:
        return None


class BindsText(Bed):
    def bind(self, model: DiscreteModel, label: str) -> Any:
        return "springs"


class HalfTheStress(NeoHookean):
    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return scale(0.5, NeoHookean.first_piola(F, params))


class Weightless(NeoHookean):
    @property
    def wave_speed(self) -> float:
        return float("nan")


class StandsStill(VelocityVerlet):
    def advance(self, state: Any, dynamics: Any, step_size: float) -> Any:
        return state


class BackToZero(VelocityVerlet):
    def advance(self, state: Any, dynamics: Any, step_size: float) -> Any:
        return attrs.evolve(super().advance(state, dynamics, step_size), time=0.0)


class Backwards(VelocityVerlet):
    def advance(self, state: Any, dynamics: Any, step_size: float) -> Any:
        return super().advance(
            attrs.evolve(state, time=state.time - 2.0 * step_size), dynamics, step_size
        )


@attrs.frozen
class Odd(Discretisation):
    """A lattice with something wrong."""

    name: str
    value: Any

    def particles(self, shape: Shape, spacing: float) -> Particles:
        made = Lattice().particles(shape, spacing)
        values = np.array(getattr(made, self.name), copy=True)
        values[3] = self.value
        return attrs.evolve(made, **{self.name: values})

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        return False


class NoParticles(Odd):
    def particles(self, shape: Shape, spacing: float) -> Any:
        return {"positions": []}


SOFT = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}


def bed(**wanted: Any) -> SceneBuilder:
    """A block that swings on springs."""
    return (
        box(2, 5)
        .effect(Bed(**wanted))
        .initial(velocity={"x": "sin(5*X)"})
        .duration(5e-3)
        .outputs(4)
    )
