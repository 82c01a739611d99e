"""The conformance kits: a part that breaks a promise is caught, and so is every promise once."""

from __future__ import annotations

import subprocess
import sys
from math import exp, sqrt
from typing import ClassVar

import attrs
import numpy as np
import pytest

from solidsph import (
    Divergence,
    Formulation,
    Gradient,
    Integrator,
    Kernel,
    Material,
    SceneError,
    State,
)
from solidsph.arrays import Array, Scalar, Tensor
from solidsph.dynamics import Dynamics
from solidsph.interfaces.formulation import Configuration
from solidsph.neighbours import Pairs
from solidsph.tensors import (
    add,
    contraction,
    green_lagrange,
    identity,
    product,
    scale,
    small_strain,
    trace,
    transpose,
)
from solidsph.testing import checks, conformance, example_part, kits

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


KERNELS = [
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


MATERIALS = [
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
        return super().advance(state, attrs.evolve(dynamics, motions=[]), step_size)


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

WRONG = {
    "kernels": KERNELS,
    "materials": MATERIALS,
    "integrators": INTEGRATORS,
    "gradients": GRADIENTS,
    "formulations": FORMULATIONS,
}
GOOD = {
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


def test_example_parts_take_typical_values_where_none_are_given() -> None:
    typical = example_part("materials", "neo-hookean")
    other = example_part("materials", "neo-hookean", poissons_ratio=0.1)
    assert typical.density == other.density
    assert (typical.poissons_ratio, other.poissons_ratio) == (0.3, 0.1)
    with pytest.raises(SceneError, match="missing parameter 'lengths'"):
        example_part("shapes", "box")


def test_checks_need_no_hypothesis() -> None:
    script = (
        "import sys; sys.modules['hypothesis'] = None\n"
        "from solidsph.testing import conformance\n"
        "assert all(result.passed for result in conformance('kernels', 'cubic-spline'))\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)
