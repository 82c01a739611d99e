"""A boundary handler that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph import (
    BoundaryHandler,
)
from solidsph.interfaces.compilable_terms import ScheduledLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import (
    Constraint,
    FieldTerm,
    Load,
    Observation,
    StressTerm,
    Term,
)
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.boundaries.ghost_extension import Extension, GhostExtension


@attrs.frozen(eq=False)
class HeldInPlace(Constraint):
    label: str
    held: Mask

    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[self.held] = 0.0

    def report(self, observation: Observation) -> dict[str, float]:
        return {f"{self.label} count [-]": float(self.held.sum())}


def held_left(model: DiscreteModel) -> Mask:
    held = np.zeros(model.particles.positions.shape, dtype=np.bool_)
    held[model.select("left")] = True
    return held


@attrs.frozen
class GoodHandler(BoundaryHandler):
    """u = 0 on the left face."""

    condition: ClassVar[Any] = HeldInPlace

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [self.condition(label, held_left(model))]


class BindsNothing(GoodHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return []


class OneMore(HeldInPlace):
    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[self.held] = 0.0
        values[-1] = 0.0


class HoldsOneMore(GoodHandler):
    condition = OneMore


class Running(HeldInPlace):
    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[self.held] = 1e3 * time if derivative == 1 else 0.0


class MovesOnTheSpot(GoodHandler):
    condition = Running


class NoUnits(HeldInPlace):
    def report(self, observation: Observation) -> dict[str, float]:
        return {"how many": float(self.held.sum())}


class ReportsWithoutUnits(GoodHandler):
    condition = NoUnits


class KeepsForces(Extension):
    def return_forces(self, forces: Array) -> None:
        forces[self.ghosts] = 0.0


class ForgetsGhosts(BoundaryHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        (right,) = GhostExtension().bind(model, label)
        names = ("label", "ghosts", "shape", "displacement", "stress")
        return [KeepsForces(**{name: getattr(right, name) for name in names})]


@attrs.frozen(eq=False)
class NoStress(StressTerm):
    label: str

    def impose_stress(self, time: float, stress: Array) -> None:
        stress[:] = 0.0

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


class StressFree(BoundaryHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [NoStress(label)]


@attrs.frozen(eq=False)
class Push(Load):
    """By how often it has been asked."""

    label: str
    particles: Indices
    times: list[float] = attrs.field(factory=list)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        self.times.append(time)
        return np.full((len(self.particles), positions.shape[1]), float(len(self.times)))

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


class PushesMoreAndMore(BoundaryHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [Push(label, model.select("left"))]


@attrs.frozen(eq=False)
class Springs(Load):
    """Particles on springs to their places, of half the stiffness that is told."""

    label: str
    particles: Indices
    reference: Array

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        forces: Array = self.reference[self.particles] - positions[self.particles]
        return forces

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        held = np.zeros(displacements.shape)
        held[self.particles] = 2.0
        return csr_array(diags_array(held.ravel()))

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


class StiffByHalf(BoundaryHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles = model.particles
        surface = np.any(particles.area_vectors != 0.0, axis=1)
        return [Springs(label, np.flatnonzero(surface & ~particles.ghosts), particles.positions)]


class HeldWithFields(HeldInPlace, FieldTerm):
    def fields(self, observation: Observation) -> dict[str, Array]:
        return {"held [-]": np.full(len(self.held), np.nan)}


class ShowsNoNumbers(GoodHandler):
    condition = HeldWithFields


@attrs.frozen(eq=False)
class PushBySchedule(ScheduledLoad):
    """Declares a force that follows from time alone, and forms its own."""

    label: str
    particles: Indices
    dimension: int

    def schedule(self, times: Array) -> Array:
        return np.zeros((1, len(self.particles), self.dimension))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.ones((len(self.particles), self.dimension))

    def report(self, observation: Observation) -> dict[str, float]:
        return {}


class PushesOtherwise(BoundaryHandler):
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        return [PushBySchedule(label, model.select("left"), model.particles.dimension)]


BOUNDARIES = [
    (ShowsNoNumbers, {"fields"}),
    (PushesOtherwise, {"derived"}),
    (BindsNothing, {"conditions"}),
    (HoldsOneMore, {"held only"}),
    (MovesOnTheSpot, {"rates", "energy account"}),
    (ForgetsGhosts, {"virtual power"}),
    (StressFree, {"stresses"}),
    (PushesMoreAndMore, {"forces"}),
    (StiffByHalf, {"stiffness"}),
    (ReportsWithoutUnits, {"report"}),
]
