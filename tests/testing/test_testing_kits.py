"""The conformance kits: a part that breaks a promise is caught, and so is every promise once."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import EntryPoint
from math import exp, sqrt
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest

from solidsph import (
    BoundaryHandler,
    Discretisation,
    Divergence,
    Effect,
    Formulation,
    Gradient,
    Integrator,
    Kernel,
    Material,
    SceneError,
    Shape,
    State,
    cli,
)
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import PointwiseLoad, ScheduledLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.history import History
from solidsph.interfaces.shape import Surface
from solidsph.interfaces.terms import (
    Constraint,
    FieldTerm,
    Load,
    Observation,
    StressTerm,
    Term,
)
from solidsph.maths.arrays import Array, Indices, Mask, Scalar, Tensor, Vector
from solidsph.maths.tensors import (
    add,
    contraction,
    green_lagrange,
    identity,
    product,
    scale,
    scaled,
    small_strain,
    trace,
    transpose,
)
from solidsph.model.neighbours import Pairs
from solidsph.model.particles import Particles
from solidsph.registry import registry
from solidsph.run.dynamics import Dynamics
from solidsph.testing import checks, conformance, example_part, kits
from solidsph_builtin.boundaries.ghost_extension import Extension, GhostExtension
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_builtin.materials.viscoelastic import Viscoelastic
from solidsph_builtin.shapes.box import Box
from tests.helpers.waiting import HANG
from tests.testing.test_lying_parts import LIES

# Kernels, each wrong in one respect


@attrs.frozen
class GoodKernel(Kernel):
    """w = (1 - q)^4 (1 + 4 q)."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q)


class NegativeLobe(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) * (1.0 - 3.0 * q**2)


class WrongSlope(GoodKernel):
    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return -20.0 * q * (1.0 - q) ** 3 * (1.0 + 1e-9 * q)


class UnseenBySteps(GoodKernel):
    """`abs` throws the imaginary part away, so a complex step finds no slope."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return np.abs(1.0 - q) ** 4 * (1.0 + 4.0 * q)


class WrongNormalisation(GoodKernel):
    def closed_normalisation(self, dimension: int) -> float:
        return {1: 5.0 / 4.0, 2: 7.0 / np.pi, 3: 21.0 / (2.0 * np.pi)}[dimension]


class CutUndeclared(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return np.exp(-4.0 * q * q)


class CutDeclaredWrongly(CutUndeclared):
    def lost_mass(self, dimension: int) -> float:
        return exp(-4.0)  # true in two dimensions only


class LossWithoutCut(GoodKernel):
    def lost_mass(self, dimension: int) -> float:
        return 1e-4


class Rising(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q + 20.0 * q * q)


class Pointed(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return 1.0 - q


class UndeclaredKnot(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) + np.maximum(0.3 - q, 0.0) ** 2


class NotPointwise(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q) * (1.0 + 1e-3 * np.ndim(q))


class ManyNegative(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 2 * (1.0 + 2.0 * q) * (1.0 - 5.0 * q**2)


class ClaimsToNeverPair(GoodKernel):
    """A parabola, whose transform oscillates."""

    nonnegative_transform: ClassVar[bool] = True

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return 1.0 - q**2


KERNELS = [
    (WrongSlope, {"gradient moment"}),
    (ManyNegative, {"moments"}),
    (ClaimsToNeverPair, {"transform"}),
    (NegativeLobe, {"not negative", "falling", "mass", "support", "scaling"}),
    (WrongSlope, {"slope"}),
    (UnseenBySteps, {"slope"}),
    (WrongNormalisation, {"closed normalisation", "mass"}),
    (CutUndeclared, {"declared loss"}),
    (CutDeclaredWrongly, {"declared loss"}),
    (LossWithoutCut, {"declared loss"}),
    (Rising, {"falling"}),
    (Pointed, {"smooth centre"}),
    (UndeclaredKnot, {"mass"}),
    (NotPointwise, {"pointwise"}),
]

# Materials

LAM, MU = 2.0e6, 1.0e6


def hooke(strain: Tensor) -> Tensor:
    return add(scale(LAM * trace(strain), identity(strain)), scale(2.0 * MU, strain))


@attrs.frozen
class GoodMaterial(Material):
    """psi = lambda/2 (tr E)^2 + mu E : E."""

    density: float = 1000.0

    @property
    def params(self) -> tuple[float, ...]:
        return ()

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return LAM, MU

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        E = green_lagrange(F)
        return 0.5 * contraction(hooke(E), E)

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(F, hooke(green_lagrange(F)))

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), dF)
        dE = scale(0.5, add(half, transpose(half)))
        return add(product(dF, hooke(green_lagrange(F))), product(F, hooke(dE)))


class WrongStress(GoodMaterial):
    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return scale(1.0 + 1e-8, GoodMaterial.first_piola(F, params))


class TangentWithoutInitialStress(GoodMaterial):
    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), dF)
        return product(F, hooke(scale(0.5, add(half, transpose(half)))))


class UnsymmetricTangent(GoodMaterial):
    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(GoodMaterial.tangent(F, dF, params), F)


class Prestressed(GoodMaterial):
    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return GoodMaterial.energy(F, params) + 1e-3 * MU * trace(green_lagrange(F))

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return add(GoodMaterial.first_piola(F, params), scale(1e-3 * MU, F))


class SmallStrainOnly(GoodMaterial):
    """Claims to be objective, as the interface does by default."""

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return 0.5 * contraction(hooke(small_strain(F)), small_strain(F))

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return hooke(small_strain(F))


class TooModest(GoodMaterial):
    objective: ClassVar[bool] = False


class OtherConstants(GoodMaterial):
    @property
    def lame_parameters(self) -> tuple[float, float]:
        return LAM, 1.001 * MU


class BulkWaveSpeed(GoodMaterial):
    @property
    def wave_speed(self) -> float:
        return sqrt((LAM + 2.0 / 3.0 * MU) / self.density)


class OtherPlane(GoodMaterial):
    """Its missing strains are those of no lateral stress."""

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        missing = -LAM / (LAM + 2.0 * MU) * trace(green_lagrange(F)) * (len(F) < 3)
        return GoodMaterial.energy(F, params) + 0.5 * LAM * missing**2


class ArraysOnly(GoodMaterial):
    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return GoodMaterial.energy(F, params) * np.ones(F.shape[2])


class TurnedStress(GoodMaterial):
    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(hooke(green_lagrange(F)), F)


class Softening(GoodMaterial):
    """Its shear modulus is negative, though it declares another."""

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        return scale(-1.0, GoodMaterial.tangent(F, dF, params))


class GoodMemory(Viscoelastic):
    """One Maxwell element beside a neo-Hookean spring."""

    def __init__(self) -> None:
        super().__init__([(0.5, 1e-2)], 1e6, 0.3, 1000.0)


class BornOld(GoodMemory):
    def initial_history(self, dimension: int) -> Mapping[str, float]:
        return dict.fromkeys(super().initial_history(dimension), 1e-3)


class StressOfTheVirgin(GoodMemory):
    @staticmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        return Viscoelastic.first_piola(F, params)


class GivesBack(GoodMemory):
    @staticmethod
    def dissipated(history: History) -> Scalar:
        return -history[-1]


class Silent(GoodMemory):
    @staticmethod
    def dissipated(history: History) -> Scalar:
        return 0.0 * history[-1]


class RemembersDirections(GoodMemory):
    """Its viscous strain follows the left Cauchy-Green tensor, which turns with the body."""

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return Viscoelastic.advance(transpose(F), history, step, params)


class TurnedMemory(GoodMemory):
    @staticmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        return transpose(Viscoelastic.stress(F, history, params))


class FlatMemory(GoodMemory):
    """Relaxes sooner where dimensions are missing."""

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return Viscoelastic.advance(F, history, step * 3.0 / len(F), params)


class Hasty(GoodMemory):
    rate_dependent: ClassVar[bool] = False


class MemoryOfArraysOnly(GoodMemory):
    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return tuple(
            one * np.ones(F.shape[2]) for one in Viscoelastic.advance(F, history, step, params)
        )


def test_the_memory_that_the_wrong_ones_differ_from_passes() -> None:
    assert failed("materials", GoodMemory()) == set()


MEMORIES = [
    (BornOld, {"virgin state"}),
    (StressOfTheVirgin, {"stress with history"}),
    (GivesBack, {"dissipation"}),
    (Silent, {"energy balance"}),
    (RemembersDirections, {"objectivity of history"}),
    (TurnedMemory, {"angular momentum of history"}),
    (FlatMemory, {"missing dimensions of history"}),
    (Hasty, {"rate dependence"}),
    (MemoryOfArraysOnly, {"pointwise history"}),
]


MATERIALS = [
    *MEMORIES,
    (TurnedStress, {"stress measures"}),
    (Softening, {"ellipticity"}),
    (WrongStress, {"stress"}),
    (TangentWithoutInitialStress, {"tangent"}),
    (UnsymmetricTangent, {"symmetric tangent"}),
    (Prestressed, {"natural state"}),
    (SmallStrainOnly, {"objectivity", "angular momentum"}),
    (TooModest, {"objectivity"}),
    (OtherConstants, {"small strain"}),
    (BulkWaveSpeed, {"wave speed"}),
    (OtherPlane, {"missing dimensions"}),
    (ArraysOnly, {"pointwise"}),
]

# Integrators


@attrs.frozen
class GoodIntegrator(Integrator):
    """Symplectic Euler, of the first order."""

    order: ClassVar[int] = 1
    stability_limit: ClassVar[float] = 2.0

    def start(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        response = dynamics.respond(state.time, state.positions, state.velocities)
        return attrs.evolve(
            state,
            accelerations=response.accelerations,
            applied=response.applied,
            work=dict.fromkeys(response.applied, 0.0),
        )

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        velocities = dynamics.carry(time, state.velocities + step_size * state.accelerations)
        positions = dynamics.place(time, state.positions + step_size * velocities)
        response = dynamics.respond(time, positions, velocities)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=velocities,
            accelerations=response.accelerations,
            applied=response.applied,
            memory=state.memory,
        )


class FirstOrderClaimingSecond(GoodIntegrator):
    order: ClassVar[int] = 2


class LimitTooHigh(GoodIntegrator):
    stability_limit: ClassVar[float] = 2.1


class LimitTooModest(GoodIntegrator):
    stability_limit: ClassVar[float] = 1.5


class NoMotionImposed(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return super().advance(state, attrs.evolve(dynamics, constraints=[]), step_size)


class NoWork(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return attrs.evolve(super().advance(state, dynamics, step_size), work=state.work)


class InPlace(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        after = super().advance(state, dynamics, step_size)
        state.positions[:] = after.positions
        return attrs.evolve(after, positions=state.positions)


class TimeStandsStill(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return attrs.evolve(super().advance(state, dynamics, step_size), time=state.time)


class DampedByOldVelocity(GoodIntegrator):
    """Velocity Verlet, but forces see the velocity at half a step."""

    order: ClassVar[int] = 2

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        half = state.velocities + 0.5 * step_size * state.accelerations
        positions = dynamics.place(time, state.positions + step_size * half)
        response = dynamics.respond(time, positions, half)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=dynamics.carry(time, half + 0.5 * step_size * response.accelerations),
            accelerations=response.accelerations,
            applied=response.applied,
            memory=state.memory,
        )


INTEGRATORS = [
    (FirstOrderClaimingSecond, {"order", "order with damping"}),
    (LimitTooHigh, {"stable below limit"}),
    (LimitTooModest, {"unstable above limit"}),
    (NoMotionImposed, {"imposed motion"}),
    (NoWork, {"work of loads"}),
    (InPlace, {"bookkeeping"}),
    (TimeStandsStill, {"bookkeeping"}),
    (DampedByOldVelocity, {"order with damping"}),
]

# Gradients


@attrs.frozen
class GoodGradient(Gradient):
    """g_pq = dW/dx_p V_q on differences."""

    exact_degree: ClassVar[int] = 0

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights = kernel_gradients * volumes[pairs.columns, None]
        weights[pairs.self_pairs] = -pairs.row_sums(weights)
        return weights


class ClaimsLinear(GoodGradient):
    exact_degree: ClassVar[int] = 1


class ClaimsNothing(GoodGradient):
    exact_degree: ClassVar[int] = -1


class ClaimsConstant(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return kernel_gradients * volumes[pairs.columns, None]


class WithoutVolumes(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        return super().weights(pairs, kernel_gradients, np.ones_like(volumes))


class OneTooMany(GoodGradient):
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, kernel_gradients, volumes)
        return np.concatenate([weights, weights[:1]])


GRADIENTS = [
    (ClaimsLinear, {"exact degree"}),
    (ClaimsConstant, {"exact degree"}),
    (ClaimsNothing, {"no higher degree"}),
    (WithoutVolumes, {"inverse length"}),
    (OneTooMany, {"shape"}),
]

# Formulations


@attrs.frozen
class GoodFormulation(Formulation):
    """F = I + du/dX, rho_0 a = Div P."""

    configuration: ClassVar[Configuration] = Configuration.REFERENCE

    gradient: Gradient = attrs.field(factory=lambda: example_part("gradients", "corrected"))
    divergence: Divergence = attrs.field(factory=lambda: example_part("divergences", "variational"))

    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), H)

    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return P


class Transposed(GoodFormulation):
    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), transpose(H))


class AlwaysStretched(GoodFormulation):
    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(scale(1.0 + 1e-6, identity(H)), H)


class TransposedStress(GoodFormulation):
    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return transpose(P)


class WeakStress(GoodFormulation):
    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return scale(1.0 - 1e-8, P)


class WrongStressInCurrent(GoodFormulation):
    configuration: ClassVar[Configuration] = Configuration.CURRENT


def with_false_gradient() -> Formulation:
    return GoodFormulation(gradient=ClaimsConstant())


@attrs.frozen
class ClaimsEverything(Divergence):
    conserves_momentum: ClassVar[bool] = True
    adjoint: ClassVar[bool] = True
    uses_ghost_stress: ClassVar[bool] = True

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return volumes[pairs.rows, None] * gradient_weights


def with_false_divergence() -> Formulation:
    return GoodFormulation(divergence=ClaimsEverything())


FORMULATIONS = [
    (Transposed, {"rigid motion", "linear patch"}),
    (AlwaysStretched, {"rest", "rigid motion"}),
    (TransposedStress, {"angular momentum"}),
    (WeakStress, {"energy gradient"}),
    (WrongStressInCurrent, {"angular momentum"}),
    (with_false_gradient, {"translation"}),
    (with_false_divergence, {"linear momentum", "angular momentum", "adjoint"}),
]

# Divergences


@attrs.frozen
class GoodDivergence(Divergence):
    """d_pq = -V_q g_qp."""

    conserves_momentum: ClassVar[bool] = True
    adjoint: ClassVar[bool] = True
    uses_ghost_stress: ClassVar[bool] = False

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -volumes[pairs.columns, None] * gradient_weights[pairs.reversed_order()]


class MeanForce(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -gradient_weights[pairs.reversed_order()]


class OneForceTooMany(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, gradient_weights, volumes)
        return np.concatenate([weights, weights[:1]])


class Pulling(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return -super().weights(pairs, gradient_weights, volumes)


class OwnVolumes(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return volumes[pairs.rows, None] * gradient_weights


class DivergenceInPlace(GoodDivergence):
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = super().weights(pairs, gradient_weights, volumes)
        gradient_weights *= 2.0
        return weights


DIVERGENCES = [
    (OneForceTooMany, {"shape"}),
    (MeanForce, {"area"}),
    (Pulling, {"divergence inside"}),
    (OwnVolumes, {"momentum", "adjoint"}),
    (DivergenceInPlace, {"leaves its input"}),
]

# Shapes


@attrs.frozen
class GoodShape(Shape):
    """The unit square."""

    @property
    def square(self) -> Shape:
        return Box([1.0, 1.0])

    @property
    def dimension(self) -> int:
        return 2

    def bounds(self) -> tuple[Array, Array]:
        return self.square.bounds()

    def signed_distance(self, points: Array) -> Array:
        return self.square.signed_distance(points)

    def surface(self, spacing: float) -> Surface:
        return self.square.surface(spacing)

    def volume(self) -> float:
        return 1.0


class DistanceAsColumn(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return super().signed_distance(points)[:, None]


class BoundsTooSmall(GoodShape):
    def bounds(self) -> tuple[Array, Array]:
        lower, upper = super().bounds()
        return lower, 0.9 * upper


class OpenBelow(GoodShape):
    def surface(self, spacing: float) -> Surface:
        whole = super().surface(spacing)
        kept = np.array(whole.faces) != "bottom"
        faces = tuple(face for face in whole.faces if face != "bottom")
        return Surface(whole.points[kept], whole.area_vectors[kept], faces)


class LargerThanItIs(GoodShape):
    def volume(self) -> float:
        return 1.01


class DistanceFromInside(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return super().signed_distance(points) + 1e-3


class DistanceInOtherUnits(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return 1e3 * super().signed_distance(points)


class DeeperThanItIs(GoodShape):
    """Right near the boundary only: a point in the middle seems to be far from it."""

    def signed_distance(self, points: Array) -> Array:
        distance = super().signed_distance(points)
        return np.where(distance < -0.1, 4.0 * distance, distance)


class NotConvex(GoodShape):
    """A square without its middle."""

    @property
    def convex(self) -> bool:
        return True

    def signed_distance(self, points: Array) -> Array:
        hole = Box([0.4, 0.4], [0.3, 0.3]).signed_distance(points)
        return np.maximum(super().signed_distance(points), -hole)


class InsideOut(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return -super().signed_distance(points)


class SampledCoarsely(GoodShape):
    def surface(self, spacing: float) -> Surface:
        return super().surface(0.1)


class FacesBySpacing(GoodShape):
    def surface(self, spacing: float) -> Surface:
        whole = super().surface(spacing)
        return attrs.evolve(whole, faces=tuple(f"{face}-{spacing:g}" for face in whole.faces))


SHAPES = [
    (DistanceAsColumn, {"arrays"}),
    (BoundsTooSmall, {"bounds"}),
    (OpenBelow, {"closed boundary"}),
    (LargerThanItIs, {"volume"}),
    (DistanceFromInside, {"on boundary"}),
    (DistanceInOtherUnits, {"distance near boundary"}),
    (DeeperThanItIs, {"distance bound"}),
    (NotConvex, {"convex lines"}),
    (InsideOut, {"sign", "distance near boundary"}),
    (SampledCoarsely, {"sampling"}),
    (FacesBySpacing, {"named faces"}),
]

# Discretisations


@attrs.frozen
class GoodDiscretisation(Discretisation):
    """The cells of a lattice, with a layer of ghosts."""

    def particles(self, shape: Shape, spacing: float) -> Particles:
        return Lattice(ghosts=1).particles(shape, spacing)


class RefusesAll(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        raise SceneError("not today")


class WithoutLast(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=given.volumes[:-1], cells=given.volumes)


class TooHeavy(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=(1.0 + 1e-9) * given.volumes)


class Beside(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, positions=given.positions + spacing)


class TooCoarse(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        return super().particles(shape, 2.0 * spacing)


class OpenSurface(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, area_vectors=np.abs(given.area_vectors))


class FaceForgotten(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, faces=dict(list(given.faces.items())[1:]))


class TagOfAll(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        tags = {name: np.ones(given.count, dtype=np.bool_) for name in given.tags}
        return attrs.evolve(given, tags=tags)


class NoImages(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, images=np.zeros_like(given.images))


class Unseeded(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=np.random.default_rng().permutation(given.volumes))


DISCRETISATIONS = [
    (RefusesAll, {"represents a shape"}),
    (WithoutLast, {"arrays"}),
    (TooHeavy, {"volumes"}),
    (Beside, {"inside"}),
    (TooCoarse, {"spacing"}),
    (OpenSurface, {"closed surface"}),
    (FaceForgotten, {"faces"}),
    (TagOfAll, {"tags"}),
    (NoImages, {"images"}),
    (Unseeded, {"same bits"}),
]

# Boundary handlers


@attrs.frozen(eq=False)
class HeldInPlace(Constraint):
    label: str
    held: Mask

    def impose(self, time: float, derivative: int, values: Array) -> None:
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
    def impose(self, time: float, derivative: int, values: Array) -> None:
        values[self.held] = 0.0
        values[-1] = 0.0


class HoldsOneMore(GoodHandler):
    condition = OneMore


class Running(HeldInPlace):
    def impose(self, time: float, derivative: int, values: Array) -> None:
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
    (ReportsWithoutUnits, {"report"}),
]

# Effects


@attrs.frozen(eq=False)
class Drag(Load):
    label: str
    particles: Indices
    resistance: Array  # (k, 1) [kg/s]

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

    def arrays(self, model: DiscreteModel) -> dict[str, int]:
        return {"resistance": model.masses.nbytes}

    def damping_rate(self, bodies: Sequence[Body]) -> float:
        return 1.0

    def stiffness_rate(self, bodies: Sequence[Body]) -> float:
        return 0.0


class OtherLabel(GoodEffect):
    def bind(self, model: DiscreteModel, label: str) -> Load:
        return super().bind(model, "mine")


class DragInPlace(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        positions *= 1.0 + 1e-3
        return super().forces(time, positions, velocities)


class MovesParticles(GoodEffect):
    condition = DragInPlace


class NegativeSize(GoodEffect):
    def arrays(self, model: DiscreteModel) -> dict[str, int]:
        return {"resistance": -1}


class ClaimsMomentum(GoodEffect):
    conserves_momentum: ClassVar[bool] = True


class DragForward(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -super().forces(time, positions, velocities)


class Drives(GoodEffect):
    condition = DragForward


class DampsMoreThanDeclared(GoodEffect):
    def damping_rate(self, bodies: Sequence[Body]) -> float:
        return 0.9


class Anchor(Drag):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -1e4 * self.resistance * positions[self.particles]


class StiffUndeclared(GoodEffect):
    condition = Anchor


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


@pytest.fixture(autouse=True)
def _mended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is done to the class is undone."""
    monkeypatch.setattr(NeoHookean, "first_piola", staticmethod(neo_hookean_stress))


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
    (EffectWithoutUnits, {"report"}),
    (LeavesItsMark, {"nothing when absent"}),
]

WRONG = {
    "divergences": DIVERGENCES,
    "shapes": SHAPES,
    "discretisations": DISCRETISATIONS,
    "boundaries": BOUNDARIES,
    "effects": EFFECTS,
    "kernels": KERNELS,
    "materials": MATERIALS,
    "integrators": INTEGRATORS,
    "gradients": GRADIENTS,
    "formulations": FORMULATIONS,
}
GOOD = {
    "divergences": GoodDivergence,
    "shapes": GoodShape,
    "discretisations": GoodDiscretisation,
    "boundaries": GoodHandler,
    "effects": GoodEffect,
    "kernels": GoodKernel,
    "materials": GoodMaterial,
    "integrators": GoodIntegrator,
    "gradients": GoodGradient,
    "formulations": GoodFormulation,
}


def failed(kind: str, part: object) -> set[str]:
    return {result.name for result in conformance(kind, part) if not result.passed}


@pytest.mark.parametrize("kind", kits())
def test_the_part_that_the_wrong_ones_differ_from_passes(kind: str) -> None:
    assert failed(kind, GOOD[kind]()) == set()


@pytest.mark.parametrize(
    ("kind", "make", "broken"),
    [(kind, make, broken) for kind in kits() for make, broken in WRONG[kind]],
    ids=lambda value: getattr(value, "__name__", None),
)
# What a broken part does with the numbers on the way is its own affair.
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_broken_promise_is_found(kind: str, make: type[object], broken: set[str]) -> None:
    assert broken <= failed(kind, make())


@pytest.mark.parametrize("kind", kits())
def test_every_check_is_shown_to_fail_above(kind: str) -> None:
    shown = set().union(*(broken for _, broken in WRONG[kind]))
    shown |= {check.replace("_", " ") for own, _, _, check in LIES.values() if own == kind}
    assert {check.__name__.replace("_", " ") for check in checks(kind)} == shown


class Broken(GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        raise ZeroDivisionError("out of order")


def test_an_exception_is_a_failed_result_with_its_message() -> None:
    results = conformance("kernels", Broken())
    assert len(results) == len(checks("kernels"))
    spoken = [result for result in results if "ZeroDivisionError: out of order" in result.measured]
    assert {"mass", "slope", "falling"} <= {result.name for result in spoken}
    assert not any(result.passed for result in spoken)


def test_a_result_says_what_was_measured_and_what_is_required() -> None:
    results = {one.name: one for one in conformance("kernels", Rising())}
    assert not results["falling"].passed
    assert "at most 1e-15" in results["falling"].measured
    assert results["falling"].required.startswith("The profile does not rise")


def test_a_kit_takes_a_name_or_an_object_of_its_kind_only() -> None:
    assert conformance("kernels", "cubic-spline")[0].passed
    with pytest.raises(SceneError, match="expected a name"):
        conformance("kernels", GoodGradient())
    with pytest.raises(SceneError, match="no conformance kit for 'cases'"):
        conformance("cases", "tensile-instability")


def test_example_parts_take_the_values_of_their_example_where_none_are_given() -> None:
    typical = example_part("materials", "neo-hookean")
    other = example_part("materials", "neo-hookean", poissons_ratio=0.1)
    assert typical.density == other.density
    assert (typical.poissons_ratio, other.poissons_ratio) == (0.3, 0.1)
    for name, typical_of in (("union", 2), ("difference", 1)):
        of = example_part("shapes", name).of
        assert len(of if isinstance(of, tuple) else [of]) == typical_of


def test_example_parts_say_which_value_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Box, "example", {})
    with pytest.raises(SceneError, match=r"'lengths'; add it to `example` in .*box:Box, or give"):
        example_part("shapes", "box")


@attrs.frozen
class Sharp(GoodKernel):
    """A part of a third party, with required parameters of names of its own."""

    sharpness: float
    edge: float = attrs.field(alias="rim")

    example: ClassVar[Mapping[str, Any]] = {"sharpness": 70.0, "rim": 2.5}


@attrs.frozen
class SharpWithoutExample(GoodKernel):
    sharpness: float


@pytest.fixture
def foreign_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two kernels, registered as those of another distribution are."""
    points = [
        EntryPoint(name, f"{__name__}:{cls.__name__}", "solidsph.kernels")
        for name, cls in {"sharp": Sharp, "bare": SharpWithoutExample}.items()
    ]
    monkeypatch.setattr(
        registry, "entry_points", lambda group: points if group == "solidsph.kernels" else []
    )


@pytest.mark.usefixtures("foreign_kernels")
def test_a_third_partys_part_is_checked_with_its_own_example(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert example_part("kernels", "sharp") == Sharp(70.0, 2.5)
    assert example_part("kernels", "sharp", rim=3.0) == Sharp(70.0, 3.0)
    cli.cli.main(["check", "sharp", "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out)["passed"]


@pytest.mark.usefixtures("foreign_kernels")
def test_a_third_partys_part_without_an_example_needs_its_value() -> None:
    expected = r"'sharpness'; add it to `example` in .*:SharpWithoutExample.*--set sharpness="
    with pytest.raises(SceneError, match=expected):
        cli.cli.main(["check", "bare"], standalone_mode=False)
    assert example_part("kernels", "bare", sharpness=60.0) == SharpWithoutExample(60.0)


@pytest.mark.parametrize("kind", kits())
def test_every_built_in_part_has_an_example_of_each_required_parameter(kind: str) -> None:
    for name in registry.names(kind):
        assert isinstance(example_part(kind, name), registry.interface(kind))


@pytest.mark.parametrize(
    ("kind", "name"),
    # Materials are put to their checks one by one, in tests/plugins/materials/test_materials.py.
    [(kind, name) for kind in kits() if kind != "materials" for name in registry.names(kind)],
    ids=lambda value: value,
)
def test_every_installed_part_conforms(kind: str, name: str) -> None:
    results = conformance(kind, example_part(kind, name))
    assert [result for result in results if not result.passed] == []


def test_every_kind_of_part_but_a_case_has_a_kit() -> None:
    assert set(kits()) == set(registry.INTERFACES) - {"cases"}


def test_checks_need_no_hypothesis() -> None:
    script = (
        "import sys; sys.modules['hypothesis'] = None\n"
        "from solidsph.testing import conformance\n"
        "assert all(result.passed for result in conformance('kernels', 'cubic-spline'))\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=HANG)
