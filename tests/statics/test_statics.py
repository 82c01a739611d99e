"""Equilibria, natural frequencies and the stable step, against closed forms and against runs."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from itertools import pairwise

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import csr_array, diags_array

from solidsph import SceneError, Simulation, SolidsphError
from solidsph.errors import ConvergenceError
from solidsph.interfaces.terms import Load, Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.registry import registry
from solidsph.run.energy import strain_energy
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import (
    critical_step,
    equilibrium,
    frequencies,
    highest_frequency,
    tangent,
)
from solidsph.studies.spectrum import spectrum
from solidsph.testing import example_part
from tests.helpers.scenes import SOFT, box

MU = 1e6 / 2.6
LAM = 2.0 * MU * 0.3 / 0.4
SPEED = np.sqrt((LAM + 2.0 * MU) / 1000.0)

ON_BOUNDARY = {"type": "lattice", "on_boundary": True}


def confined_stress(stretch: float) -> float:
    """P of the neo-Hookean law in uniaxial strain."""
    return float(MU * (stretch - 1.0 / stretch) + LAM * np.log(stretch) / stretch)


def displacements(simulation: Simulation, state) -> Array:
    moved: Array = state.positions - simulation.particles.positions
    return moved


def shaken(simulation: Simulation, amplitude: float = 0.02) -> Array:
    """Random displacements, (n, d), small beside the spacing so that no volume turns over."""
    particles = simulation.particles
    random = np.random.default_rng(3).uniform(-1.0, 1.0, particles.positions.shape)
    return amplitude * particles.spacings[:, None] * random


# --- The tangent ---------------------------------------------------------------------------------


@pytest.mark.parametrize("gradient", registry.names("gradients"))
@pytest.mark.parametrize("material", registry.names("materials"))
@pytest.mark.parametrize("d", [1, 2, 3])
def test_tangent_is_minus_the_derivative_of_the_forces(
    d: int, material: str, gradient: str
) -> None:
    simulation = (
        box(d, 4 if d == 3 else 6)
        .material(example_part("materials", material))
        .formulation("total-lagrangian", gradient=gradient, divergence="variational")
        .build()
    )
    u = shaken(simulation)
    if not simulation.model.bodies[0].material.smooth:
        # Away from where fibres slacken: there the law has two tangents.
        u = u + 0.15 * simulation.particles.positions
    K = tangent(simulation, u)
    direction = np.random.default_rng(4).uniform(-1.0, 1.0, u.shape)
    # Error of a central difference: (h / spacing)^2 of the third derivative, 1e-8 here.
    h = 1e-4 * simulation.particles.spacings.min()
    forces = [simulation.dynamics.internal.forces(0.0, u + s * h * direction) for s in (-1, 1)]
    numerical = (forces[0] - forces[1]).ravel() / (2.0 * h)
    assert K @ direction.ravel() == pytest.approx(numerical, abs=1e-6 * np.abs(numerical).max())
    # Sums of a few hundred terms in two orders.
    assert abs(K - K.T).max() < 1e-13 * abs(K).max()


@pytest.mark.parametrize("divergence", ["plain", "variational"])
@pytest.mark.parametrize("handler", ["ghost-extension", "symmetry"])
def test_ghosts_are_eliminated_from_the_tangent(divergence: str, handler: str) -> None:
    """One Newton step from a state that linear forces know exactly ends in balance."""
    ghosts = {"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]}
    builder = (
        box(2, 8, discretisation=ghosts)
        .material("linear-elastic", **SOFT)
        .formulation("total-lagrangian", divergence=divergence)
        .boundary("clamp", where="right")
        .effect("body-force", acceleration={"x": 1.0, "y": "-X"})
    )
    if handler == "symmetry":
        builder = builder.boundary("symmetry", axis="x")
    else:
        builder = builder.boundary("ghost-extension")
    result = equilibrium(builder.build())
    # The forces are linear, so the tangent alone decides: what one step leaves is rounding.
    assert result.iterations == 1
    assert result.residual < 1e-10
    assert result.stable is (True if divergence == "variational" else None)


def test_an_exact_dirichlet_condition_is_met_in_equilibrium() -> None:
    simulation = (
        box(2, 8, discretisation={"type": "lattice", "on_boundary": True, "ghosts": 3})
        .formulation("total-lagrangian", gradient="standard", divergence="plain")
        .boundary(
            "exact-dirichlet",
            where="surface",
            displacement={"x": "0.1*X + 0.05*X*Y", "y": "-0.05*Y"},
            label="walls",
        )
        .build()
    )
    result = equilibrium(simulation)
    moved = simulation.dynamics.observe(result.state)
    walls = next(c for c in simulation.terms if c.label == "walls")
    assert walls.report(moved)["walls miss [m]"] < 1e-12
    assert result.residual < 1e-9


def test_the_updated_form_is_refused() -> None:
    simulation = box(2).formulation("updated-lagrangian", gradient="difference").build()
    with pytest.raises(SolidsphError, match="use 'total-lagrangian'"):
        tangent(simulation, np.zeros_like(simulation.particles.positions))


# --- Equilibrium against closed forms ------------------------------------------------------------


@pytest.mark.parametrize("stretch", [0.6, 1.8])
def test_imposed_stretch_of_a_confined_column(stretch: float) -> None:
    """A constant imposed motion is brought on in proportion; its reaction is P(s) A."""
    simulation = (
        box(1, 20)
        .boundary("clamp", where="X < 0.15")
        .boundary("prescribed-motion", where="X > 0.85", displacement={"x": 0.7 * (stretch - 1.0)})
        .build()
    )
    inner = box(1, 20)
    inner = inner.boundary(
        "prescribed-motion",
        where="X < 0.3 or X > 0.7",
        displacement={"x": f"{stretch - 1.0}*(X-0.125)"},
    )
    result = equilibrium(inner.build())
    observation = inner.build().dynamics.observe(result.state)
    # Rounding of a sum over six neighbours, times the condition of the matrix.
    assert observation.deformation_gradients[:, 0, 0] == pytest.approx(stretch, rel=1e-10)
    (reaction,) = (force for force in result.state.applied.values())
    assert reaction[:10].sum() == pytest.approx(-confined_stress(stretch), rel=1e-10)
    # The same, moved as blocks: equal reactions at both ends.
    blocks = equilibrium(simulation)
    ends = [force.sum() for force in blocks.state.applied.values()]
    assert sum(ends) == pytest.approx(0.0, abs=1e-9 * abs(ends[0]))


def column(cells: int, traction: float | str, **terms) -> SceneBuilder:
    return (
        box(1, cells, discretisation=ON_BOUNDARY)
        .material(**terms or {"material": "neo-hookean", **SOFT})
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": traction})
    )


@pytest.mark.parametrize("traction", [-3e5, 3e5])
def test_column_under_dead_load(traction: float) -> None:
    """P(s) = mu (s - 1/s) + lambda ln(s) / s.

    The mean stress is exact, because the gradient of X is. The stretch is not, because the stress
    of the outermost particles cannot be in balance one by one; that costs an error of the order
    of the spacing.
    """
    expected = brentq(lambda s: confined_stress(s) - traction, 0.2, 5.0)
    errors = []
    for cells in (20, 40, 80):
        simulation = column(cells, traction).build()
        result = equilibrium(simulation)
        observation = simulation.dynamics.observe(result.state)
        mean = np.vdot(simulation.particles.volumes, observation.stresses[:, 0, 0])
        assert mean == pytest.approx(traction, rel=1e-8)  # ten times the tolerance of the forces
        errors.append(float(np.ptp(result.state.positions)) / expected - 1.0)
    assert abs(errors[-1]) < 5e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_newton_converges_quadratically() -> None:
    result = equilibrium(column(30, -3e5).build(), tolerance=1e-12)
    (step,) = result.steps
    logs = np.log10(step.residuals)
    # The digits double: as soon as there is one, until rounding at about 1e-13.
    orders = [b / a for a, b in pairwise(logs) if -5.5 < a < -1.0]
    assert orders
    assert min(orders) > 1.6
    assert result.residual < 1e-12
    assert result.stable


def test_a_ramp_in_time_and_a_constant_end_in_the_same_place() -> None:
    constant, ramp, steps = (
        equilibrium(column(20, load).build(), load_steps=count)
        for load, count in ((-3e5, 1), ("-3e5*t/0.01", 3), (-3e5, 3))
    )
    # Each is in balance to 1e-9 of the loads.
    for other in (ramp, steps):
        assert other.state.positions == pytest.approx(constant.state.positions, abs=1e-9)
    assert ramp.state.time == constant.state.time == 0.01
    assert [step.load_factor for step in steps.steps][:1] == [pytest.approx(1.0 / 3.0)]


def test_work_of_the_loads_is_the_energy_stored() -> None:
    simulation = column(20, -3e5).build()
    errors = []
    for count in (8, 16):
        result = equilibrium(simulation, load_steps=count)
        stored = strain_energy(simulation.dynamics.observe(result.state))
        assert len(result.steps) <= count
        errors.append(abs(sum(result.state.work.values()) / stored - 1.0))
    # The trapezoidal rule over the load steps, which lengthen where Newton is quick.
    assert errors[0] < 2e-2
    assert errors[1] < errors[0]


@pytest.mark.parametrize("d", [2, 3])
def test_patch(d: int) -> None:
    """Linear motion imposed on the rim: the lattice inside follows it exactly."""
    cells = 12 if d == 2 else 9
    names = "XYZ"[:d]
    rim = " or ".join(f"{x} < {3.1 / cells} or {x} > {1.0 - 3.1 / cells}" for x in names)
    motion = {"x": "0.2*X + 0.1*Y", "y": "-0.05*X - 0.1*Y"}
    if d == 3:
        motion["z"] = "0.1*X + 0.05*Z"
    simulation = (
        box(d, cells)
        .kernel("modified-mollifier", cover=1.9)
        .boundary("prescribed-motion", where=rim, displacement=motion)
        .build()
    )
    X = simulation.particles.positions
    rates = np.array([[0.2, 0.1, 0.0], [-0.05, -0.1, 0.0], [0.1, 0.0, 0.05]])[:d, :d]
    result = equilibrium(simulation)
    # Rounding times the condition of the matrix.
    assert displacements(simulation, result.state) == pytest.approx(X @ rates.T, abs=1e-11)


def tip_of_cantilever(across: int) -> float:
    """Deflection under a small end load over that of Timoshenko's beam in plane strain."""
    length, height, load = 1.0, 0.1, 1.0
    simulation = (
        Simulation.builder()
        .body(
            "beam",
            shape={"type": "box", "lengths": [length, height]},
            spacing=height / across,
            discretisation=ON_BOUNDARY,
        )
        .kernel("modified-mollifier", cover=2.6)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian", gradient="corrected")
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": load})
        .duration(1.0)
        .build()
    )
    u = displacements(simulation, equilibrium(simulation).state)
    tip = simulation.particles.faces["right"].particles
    plane_strain = 1e6 / (1.0 - 0.3**2)
    bending = load * height * length**3 / (3.0 * plane_strain * height**3 / 12.0)
    shear = load * height * length / (5.0 / 6.0 * MU * height)
    return float(u[tip, 1].mean() / (bending + shear))


def test_cantilever_is_softer_than_the_beam() -> None:
    assert 1.0 < tip_of_cantilever(8) < 1.3  # as below


@pytest.mark.validation
def test_cantilever_is_softer_than_the_beam_by_what_linear_gradients_cost() -> None:
    coarse, fine = tip_of_cantilever(8), tip_of_cantilever(16)
    # One-sided supports at free surfaces: 10 % at 9 across in a dynamic run of this kind, and
    # falling with nearly the square of the spacing.
    assert 1.0 < fine < coarse < 1.3
    assert (coarse - 1.0) / (fine - 1.0) > 2.0


def test_large_bending_is_the_end_of_a_damped_run() -> None:
    builder = (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [0.6, 0.15]}, spacing=0.03)
        .kernel("modified-mollifier", cover=2.6)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
        .effect("body-force", acceleration={"y": -60.0})
        .effect("mass-damping", rate=25.0)
        .integrator("velocity-verlet", time_step_factor=0.9)
        .duration(1.3)
    )
    simulation = builder.build()
    static = displacements(simulation, equilibrium(simulation).state)
    damped = displacements(simulation, simulation.run().state)
    assert np.abs(static).max() > 0.15
    # Damped a little below critical, the slowest motion decays as exp(-12.5 t): 1e-7 is left.
    assert damped == pytest.approx(static, abs=1e-6 * np.abs(static).max())


def test_a_slender_beam_in_large_bending_takes_few_iterations() -> None:
    """Turek and Hron's beam under twice its gravity, in one load step.

    Plain Newton iteration takes 16 or more, with steps cut to an eighth; see `equilibrium`.
    """
    simulation = (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [0.35, 0.02]}, spacing=0.004)
        .kernel("modified-mollifier", cover=2.6)
        .material(
            "saint-venant-kirchhoff", youngs_modulus=1.4e6, poissons_ratio=0.4, density=1000.0
        )
        .boundary("clamp", where="left")
        .effect("body-force", acceleration={"y": -4.0})
        .duration(1.0)
        .build()
    )
    result = equilibrium(simulation)
    assert displacements(simulation, result.state)[-1, 1] < -0.1
    assert len(result.steps) == 1
    assert result.iterations <= 8


def in_order(positions: Array) -> Indices:
    """Numbers of lattice points in the order of their coordinates."""
    return np.lexsort(np.rint(positions / 1e-3).T)


def test_half_a_body_with_a_symmetry_plane_is_half_of_the_whole() -> None:
    def pulled(lengths: list[float], discretisation) -> SceneBuilder:
        return (
            Simulation.builder()
            .body(
                "block",
                shape={"type": "box", "lengths": lengths, "origin": [1.0 - lengths[0], 0.0]},
                spacing=0.1,
                discretisation=discretisation,
            )
            .kernel("modified-mollifier", cover=2.6)
            .material("neo-hookean", **SOFT)
            .boundary("clamp", where="bottom")
            .boundary("traction", where="top", traction={"y": 2e5})
            .duration(1.0)
        )

    whole = pulled([2.0, 1.0], "lattice").build()
    half = (
        pulled([1.0, 1.0], {"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]})
        .boundary("symmetry", axis="x")
        .build()
    )
    right = np.flatnonzero(whole.particles.positions[:, 0] > 0.0)
    real = np.flatnonzero(~half.particles.ghosts)
    # The two are numbered along different axes.
    right = right[in_order(whole.particles.positions[right])]
    real = real[in_order(half.particles.positions[real])]
    assert whole.particles.positions[right] == pytest.approx(half.particles.positions[real])
    expected = displacements(whole, equilibrium(whole, tolerance=1e-11).state)[right]
    found = displacements(half, equilibrium(half, tolerance=1e-11).state)[real]
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_two_bodies_are_as_each_alone() -> None:
    def scene(names: str) -> SceneBuilder:
        builder = Simulation.builder().kernel("modified-mollifier", cover=2.6).duration(1.0)
        for name, corner, modulus in (("a", 0.0, 1e6), ("b", 3.0, 3e5)):
            if name in names:
                builder = builder.body(
                    name,
                    shape={"type": "box", "lengths": [1.0, 1.0], "origin": [corner, 0.0]},
                    spacing=0.125,
                    material={"type": "neo-hookean", **SOFT, "youngs_modulus": modulus},
                )
        return builder.boundary("clamp", where="bottom").effect(
            "body-force", acceleration={"x": 20.0}
        )

    both, alone = (scene(names).build() for names in ("ab", "b"))
    together = displacements(both, equilibrium(both, tolerance=1e-11).state)
    single = displacements(alone, equilibrium(alone, tolerance=1e-11).state)
    extent = both.particles.bodies["b"]
    assert together[extent] == pytest.approx(single, abs=1e-9 * np.abs(single).max())
    # The softer one moves further.
    assert np.abs(together[extent]).max() > 2.0 * np.abs(together[: extent.start]).max()


# --- Loads that have a stiffness -----------------------------------------------------------------


@attrs.frozen(eq=False)
class Springs(Load):
    """Every particle on a spring to its own place."""

    label: str
    particles: Indices
    positions: Array
    constant: float  # [N/m]
    told: bool = True

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -self.constant * (positions - self.positions)

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        return csr_array(self.constant * diags_array(np.ones(displacements.size)))

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@attrs.frozen(eq=False)
class Wind(Load):
    """A constant force, of a load that has a number for a stiffness."""

    label: str
    particles: Indices
    stiffness: float = 3.0

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.ones((len(self.particles), positions.shape[1]))

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


def test_a_number_called_stiffness_is_none() -> None:
    simulation = box(1, 10).boundary("clamp", where="left").build()
    wind = Wind("wind", np.arange(1, 10))
    blown = attrs.evolve(simulation, dynamics=attrs.evolve(simulation.dynamics, loads=[wind]))
    assert equilibrium(blown).residual < 1e-9


def on_springs(builder: SceneBuilder, constant: float) -> Simulation:
    simulation = builder.build()
    X = simulation.particles.positions
    springs = Springs("springs", np.arange(len(X)), X, constant)
    loads = [*simulation.dynamics.loads, springs]
    return attrs.evolve(simulation, dynamics=attrs.evolve(simulation.dynamics, loads=loads))


def test_a_stiff_load_takes_part_in_the_tangent() -> None:
    builder = box(1, 10).effect("body-force", acceleration={"x": 5.0})
    simulation = on_springs(builder, 1e3)
    result = equilibrium(simulation)
    # Every particle weighs 100 kg and moves alike: m b / k, in one iteration.
    assert displacements(simulation, result.state) == pytest.approx(0.5, rel=1e-9)
    assert result.iterations == 1
    rigid = np.sqrt(1e3 / 100.0)
    assert frequencies(simulation, 1).angular_frequencies == pytest.approx([rigid], rel=1e-8)


# --- Failures ------------------------------------------------------------------------------------


def test_a_load_beyond_the_limit_point_says_so() -> None:
    """Saint Venant-Kirchhoff in compression: |P| = (lambda + 2 mu)(s - s^3) / 2 has a maximum."""
    limit = (LAM + 2.0 * MU) / (3.0 * np.sqrt(3.0))
    builder = column(10, -1.05 * limit, material="saint-venant-kirchhoff", **SOFT)
    with pytest.raises(ConvergenceError, match="limit point") as caught:
        equilibrium(builder.build(), load_steps=4)
    error = caught.value
    # The outermost particle bears more than the mean and gives way first, at its own limit point.
    assert error.particle in (0, 10)
    assert error.volume_ratio == pytest.approx(1.0 / np.sqrt(3.0), rel=0.02)
    assert 0.5 < error.load_factor < 1.0
    assert error.tried > error.load_factor
    for fact in (f"{error.load_factor:.6g}", f"particle {error.particle}", "J = ", "load_steps"):
        assert fact in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)


def test_a_body_that_nothing_holds_says_so() -> None:
    simulation = box(2).effect("body-force", acceleration={"x": 1.0}).build()
    with pytest.raises(ConvergenceError, match="clamp it in every direction") as caught:
        equilibrium(simulation)
    assert caught.value.load_factor == 0.0


def test_a_body_without_loads_stays_where_it_is() -> None:
    simulation = box(2).build()
    result = equilibrium(simulation)
    assert np.array_equal(result.state.positions, simulation.particles.positions)
    assert result.iterations == 0
    assert result.residual == 0.0


@pytest.mark.parametrize(
    "arguments", [{"load_steps": 0}, {"max_iterations": 0}, {"tolerance": 0.0}]
)
def test_arguments_out_of_range_are_refused(arguments) -> None:
    with pytest.raises(SceneError, match=next(iter(arguments))):
        equilibrium(box(1).build(), **arguments)


# --- Natural frequencies -------------------------------------------------------------------------


@pytest.mark.parametrize("held", [True, False])
def test_axial_frequencies_of_a_confined_bar(held: bool) -> None:
    """c / (4 L) times the odd numbers with one end held, c / (2 L) times all with none."""
    builder = box(1, 80, discretisation=ON_BOUNDARY)
    if held:
        builder = builder.boundary("clamp", where="left")
    modes = frequencies(builder.build(), 10)
    # Neighbours that move against each other have no energy in the bulk: 0.2 is left of them.
    smooth = modes.angular_frequencies[modes.smoothness > 0.95]
    expected = np.pi * SPEED * (np.array([0.5, 1.5, 2.5]) if held else np.array([0.0, 1.0, 2.0]))
    # The clamp, and dispersion: (k h)^2 of the third mode.
    assert smooth[:3] == pytest.approx(expected, rel=6e-3, abs=1e-4 * expected[-1])


def test_a_free_body_has_its_rigid_motions() -> None:
    simulation = box(2, 6).build()
    modes = frequencies(simulation, 5)
    # Square roots of rounding, which is 1e-16 of the square of the highest frequency.
    assert np.all(modes.angular_frequencies[:3] < 1e-6 * highest_frequency(simulation))
    assert modes.angular_frequencies[3] > 1.0
    assert np.abs(modes.shapes).max(axis=(1, 2)) == pytest.approx(1.0)


def test_frequencies_are_those_of_the_dense_spectrum_under_load() -> None:
    simulation = (
        box(2, 6)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": 2e5})
        .build()
    )
    state = equilibrium(simulation).state
    dense = np.sort(spectrum(simulation.dynamics, state).frequencies)
    found = frequencies(simulation, 6, state).angular_frequencies
    # The dense matrix is numerical; its rounding weighs most on the lowest.
    assert found == pytest.approx(dense[:6], rel=1e-5)


def test_frequencies_need_forces_with_an_energy() -> None:
    simulation = box(2).formulation("total-lagrangian", divergence="plain").build()
    with pytest.raises(SolidsphError, match="variational"):
        frequencies(simulation, 1)
    with pytest.raises(SceneError, match="count"):
        frequencies(box(1, 4).build(), 4)


# --- The stable step -----------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["total-lagrangian", "updated-lagrangian"])
@pytest.mark.parametrize("d", [1, 2])
def test_highest_frequency_is_that_of_the_dense_spectrum(d: int, form: str) -> None:
    simulation = on_springs(
        box(d, 60 if d == 1 else 8).formulation(form).boundary("clamp", where="left"), 1e3
    )
    dense = spectrum(simulation.dynamics, simulation.start()).highest_frequency
    assert highest_frequency(simulation) == pytest.approx(dense, rel=1e-3)


@pytest.mark.parametrize("d", [1, 2])
def test_the_critical_step_parts_bounded_from_unbounded(d: int) -> None:
    # So small a motion that the forces stay linear until it has grown ten thousand times.
    simulation = (
        box(d, 20 if d == 1 else 8)
        .boundary("clamp", where="left")
        .initial(velocity={"x": "1e-8*sin(40*X)"})
        .build()
    )
    limit = critical_step(simulation)
    assert limit.margin == pytest.approx(limit.step / simulation.step_size)
    assert limit.margin > 1.0

    def largest_velocity(part: float) -> float:
        count = 400
        dynamics = attrs.evolve(simulation.dynamics, step_size=part * limit.step)
        fixed = attrs.evolve(simulation, dynamics=dynamics, steps=count)
        state = fixed.start()
        for _ in range(count):
            state = fixed.integrator.advance(state, fixed.dynamics, fixed.step_size)
        return float(np.abs(state.velocities).max())

    # Near the limit the scheme amplifies the highest mode by at most 1 / sqrt(1 - 0.98^2) = 5.
    assert largest_velocity(0.98) < 1e-7
    # Beyond, it grows by (1.05 + sqrt(1.05^2 - 1))^2 = 1.87 a step until the law ends it.
    with np.errstate(all="ignore"):
        assert not largest_velocity(1.05) < 1.0


def test_damping_shortens_the_critical_step() -> None:
    free = critical_step(box(1).build())
    damped = critical_step(box(1).effect("mass-damping", rate=1e3).build())
    assert damped.highest_frequency == pytest.approx(free.highest_frequency, rel=1e-6)
    total = 1e3 + np.hypot(1e3, free.highest_frequency)
    assert damped.step == pytest.approx(2.0 / total, rel=1e-6)


# --- Small loads ---------------------------------------------------------------------------------


def steel(traction: float, material: str = "neo-hookean") -> Simulation:
    """A bar of 1 x 0.2 m, pulled along its length."""
    return (
        Simulation.builder()
        .body("bar", shape={"type": "box", "lengths": [1.0, 0.2]}, spacing=0.05)
        .material(material, youngs_modulus=2e11, poissons_ratio=0.0, density=7850.0)
        .formulation("total-lagrangian")
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": traction})
        .duration(1.0)
        .build()
    )


@pytest.mark.parametrize("material", ["neo-hookean", "linear-elastic"])
@pytest.mark.parametrize("traction", [1.0, 1e3])
def test_a_unit_load_on_steel_is_in_equilibrium(material: str, traction: float) -> None:
    simulation = steel(traction, material)
    found = equilibrium(simulation)
    # The force is that of 0.2 m; what rounding leaves of it is told, and at most 1e-4.
    reaction = sum(found.state.applied["clamp left"][:, 0])
    assert found.residual < 1e-4
    assert reaction == pytest.approx(-0.2 * traction, rel=1e-4)
    # Displacements are in proportion to so small a load, 5e-6 of the modulus at most. Positions
    # round at 1e-16 m, and 1 Pa moves the end by 5e-12 m.
    much = steel(1e6, material)
    ends = [
        float(np.mean(displacements(one, state)[one.particles.tags["right"], 0]))
        for one, state in ((simulation, found.state), (much, equilibrium(much).state))
    ]
    assert ends[0] / traction == pytest.approx(ends[1] / 1e6, rel=1e-4)


def test_a_load_that_positions_cannot_hold_is_told() -> None:
    with pytest.raises(ConvergenceError, match="less than the rounding error of positions"):
        equilibrium(steel(1e-6))
