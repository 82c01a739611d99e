"""An effect that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph import (
    Effect,
)
from solidsph.interfaces.compilable_terms import PointwiseLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import (
    FieldTerm,
    Load,
    Observation,
)
from solidsph.maths.arrays import Array, Indices, Vector
from solidsph.maths.tensors import (
    scale,
    scaled,
)
from solidsph_builtin.materials.neo_hookean import NeoHookean


@attrs.frozen(eq=False)
class Drag(Load):
    label: str
    particles: Indices
    resistance: Array  # (k, 1) [kg/s]
    damping_rate = 1.0

    @property
    def arrays(self) -> Mapping[str, int]:
        return {"resistance": self.resistance.nbytes}

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -self.resistance * velocities[self.particles]

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


@attrs.frozen
class GoodEffect(Effect):
    """f = -m v / s."""

    condition: ClassVar[Any] = Drag

    def bind(self, model: DiscreteModel, label: str) -> Load:
        return self.condition(label, np.arange(model.particles.count), model.masses[:, None])


class OtherLabel(GoodEffect):
    def bind(self, model: DiscreteModel, label: str) -> Load:
        return super().bind(model, "mine")


class DragInPlace(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        positions *= 1.0 + 1e-3
        return super().forces(time, positions, velocities)


class MovesParticles(GoodEffect):
    condition = DragInPlace


class DragOfNegativeSize(Drag):
    @property
    def arrays(self) -> Mapping[str, int]:
        return {"resistance": -1}


class NegativeSize(GoodEffect):
    condition = DragOfNegativeSize


class ClaimsMomentum(GoodEffect):
    conserves_momentum: ClassVar[bool] = True


class DragForward(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -super().forces(time, positions, velocities)


class Drives(GoodEffect):
    condition = DragForward


class DragDeclaredLess(Drag):
    damping_rate = 0.9


class DampsMoreThanDeclared(GoodEffect):
    condition = DragDeclaredLess


class Anchor(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -1e4 * self.resistance * positions[self.particles]


class StiffUndeclared(GoodEffect):
    condition = Anchor


class Springs(Drag):
    """Declared in full as a frequency, by half for Newton's method."""

    stiffness_rate = 1.0

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return super().forces(time, positions, velocities + positions)

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        every = np.repeat(self.resistance, displacements.shape[1])
        return csr_array(diags_array(0.5 * every))


class StiffByHalf(GoodEffect):
    condition = Springs


class DragNoUnits(Drag):
    def report(self, observation: Observation) -> dict[str, float]:
        return {"resistance": 1.0}


class EffectWithoutUnits(GoodEffect):
    condition = DragNoUnits


class LeavesItsMark(GoodEffect):
    """Makes every neo-Hookean material stiffer from now on."""

    def bind(self, model: DiscreteModel, label: str) -> Load:
        stress = neo_hookean_stress
        type(model.bodies[0].material).first_piola = staticmethod(
            lambda F, params: scale(1.01, stress(F, params))
        )
        return super().bind(model, label)


neo_hookean_stress = NeoHookean.first_piola


class DragWithFields(Drag, FieldTerm):
    def fields(self, observation: Observation) -> dict[str, Array]:
        return {"drag [N]": np.zeros(len(self.particles) + 1)}


class ShowsOneMore(GoodEffect):
    condition = DragWithFields


@attrs.frozen(eq=False)
class OwnForces(PointwiseLoad):
    """Says by a formula what it does, and does something else."""

    label: str
    particles: Indices
    values: Array

    @staticmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        return scaled(-values[0], velocity)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -0.5 * self.values * velocities[self.particles]

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


class DoesOtherwise(GoodEffect):
    condition = OwnForces


EFFECTS = [
    (ShowsOneMore, {"fields"}),
    (DoesOtherwise, {"derived"}),
    (OtherLabel, {"bound"}),
    (MovesParticles, {"forces", "energy account"}),
    (NegativeSize, {"arrays"}),
    (ClaimsMomentum, {"momentum"}),
    (Drives, {"stored energy"}),
    (DampsMoreThanDeclared, {"damping rate"}),
    (StiffUndeclared, {"stiffness rate"}),
    (StiffByHalf, {"stiffness"}),
    (EffectWithoutUnits, {"report"}),
    (LeavesItsMark, {"nothing when absent"}),
]
