"""Hourglass control: blind to linear motions, the derivative of an energy, and of use."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import BuildError, Record, Simulation
from solidsph.engines.compiled.hourglass_sweeps import HourglassSweeps
from solidsph.interfaces.hourglass_energy import HourglassProducts
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium
from solidsph_builtin.effects.hourglass_control import HourglassControl, penalised
from tests.cases.test_beam import beam
from tests.helpers.examples import examples
from tests.helpers.scenes import box

JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 4}


def block(d: int, gradient: str = "corrected") -> SceneBuilder:
    return (
        box(d, {1: 12, 2: 6, 3: 5}[d], discretisation=JITTERED)
        .kernel("modified-mollifier", cover=3.5)
        .formulation("total-lagrangian", gradient=gradient)
        .effect("hourglass-control", strength=0.1)
    )


def penalty_of(simulation: Simulation) -> Load:
    (load,) = simulation.dynamics.loads
    return load


def random_motion(simulation: Simulation) -> Array:
    X = simulation.particles.positions
    return X + 0.01 * np.random.default_rng(1).standard_normal(X.shape)


@pytest.mark.parametrize("gradient", ["corrected", "quadratic"])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_linear_motions_are_free(d: int, gradient: str) -> None:
    simulation = block(d, gradient).build()
    X = simulation.particles.positions
    F = np.eye(d) + 0.3 * np.random.default_rng(d).standard_normal((d, d))
    penalty = penalty_of(simulation)
    forces = penalty.forces(0.0, X @ F.T + 0.7, np.zeros_like(X))
    scale = np.abs(penalty.forces(0.0, random_motion(simulation), np.zeros_like(X))).max()
    # The displacements are a hundred times those of the scale; rounding is left.
    assert np.abs(forces).max() < 1e-9 * scale


@pytest.mark.parametrize("d", [1, 2, 3])
def test_force_is_the_derivative_of_the_energy_and_keeps_momentum(d: int) -> None:
    simulation = block(d).build()
    penalty, x = penalty_of(simulation), random_motion(simulation)
    forces = penalty.forces(0.0, x, np.zeros_like(x))
    scale = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * scale
    moments = x[:, :, None] * forces[:, None, :]
    assert np.abs((moments - moments.transpose(0, 2, 1)).sum(axis=0)).max() < 1e-12 * scale
    step = np.random.default_rng(2).standard_normal(x.shape)
    # A quadratic energy: the central difference is exact but for rounding.

    def energy(positions: Array) -> float:
        state = attrs.evolve(simulation.initial, positions=positions)
        return float(penalty.energies(simulation.dynamics.observe(state)).sum())  # type: ignore[attr-defined]

    change = energy(x + 1e-3 * step) - energy(x - 1e-3 * step)
    assert change / 2e-3 == pytest.approx(-float(np.vdot(forces, step)), rel=1e-8)


def test_the_ledger_closes_and_shows_the_share(tmp_path: Path) -> None:
    def residual(factor: float) -> float:
        simulation = (
            box(2, 8)
            .boundary("clamp", where="left")
            .effect("hourglass-control")
            .initial(velocity={"y": "2*X"})
            .integrator("velocity-verlet", time_step_factor=factor)
            .duration(0.03)
            .build()
        )
        path = tmp_path / f"{factor}.h5"
        simulation.run(record=path)
        with Record(path) as record:
            history = record.history
            own, work = (
                history["hourglass-control energy [J]"],
                history["work of hourglass-control [J]"],
            )
            # What the effect has taken from the motion is what it stores.
            assert own[-1] == pytest.approx(-work[-1], rel=0.05)
            assert 0.0 < history["hourglass-control share [-]"][-1] < 0.05
            return float(np.abs(history["energy residual [J]"]).max())

    assert residual(0.4) / residual(0.2) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_checkerboard_is_no_longer_free(d: int) -> None:
    """The motion that alternates from particle to particle, away from surfaces."""

    def frequency(builder: SceneBuilder) -> float:
        simulation = builder.build()
        X = simulation.particles.positions
        spacing = simulation.particles.spacings[0]
        signs = np.where(np.rint(X / spacing - 0.5).sum(axis=1) % 2, -1.0, 1.0)
        u = 1e-6 * spacing * signs[:, None] * np.ones(d)
        response = simulation.dynamics.respond(0.0, X + u, np.zeros_like(X))
        material = simulation.model.bodies[0].material
        speed = np.sqrt(material.lame_parameters[1] / material.density)
        # Two supports inside, no sum reaches a particle whose own sums reach the surface.
        inside = np.minimum(X, 1.0 - X).min(axis=1) > 6.0 * spacing
        assert inside.any()
        u, a = u[inside], response.accelerations[inside]
        quotient = -np.vdot(u, a) / np.vdot(u, u)
        return float(np.sqrt(max(quotient, 0.0)) * spacing / speed)

    cells = {1: 24, 2: 16, 3: 13}[d]
    free = box(d, cells).kernel("modified-mollifier", cover=3.0)
    # In units of shear speed over spacing. The true wave of two spacings has pi; a soft penalty
    # gives motions that the gradient does not see about the root of its strength, here 0.32.
    before = frequency(free)
    after = frequency(free.effect("hourglass-control", strength=0.1))
    assert before < 1e-4
    assert 0.25 < after < 1.0


def recorded(builder: SceneBuilder, path: Path, u: Callable[[Array], Array]) -> Record:
    """The record of one step from displacements u of the particles at X."""
    simulation = builder.outputs(1).build()
    X = simulation.particles.positions
    start = attrs.evolve(simulation.initial, positions=X + u(X))
    attrs.evolve(simulation, initial=start, steps=1).run(record=path)
    return Record(path)


def test_the_fields_tell_a_checkerboard_from_smooth_bending(tmp_path: Path) -> None:
    spacing = 1.0 / 16
    builder = box(2, 16).effect("hourglass-control", label="control a/b")

    def checkerboard(X: Array) -> Array:
        signs = np.where(np.rint(X / spacing - 0.5).sum(axis=1) % 2, -1.0, 1.0)
        # It dies away towards the surface, where one-sided supports would see it.
        height = np.prod(np.sin(np.pi * X) ** 2, axis=1)
        return 1e-3 * spacing * (signs * height)[:, None] * np.ones(2)

    def bending(X: Array) -> Array:
        # Of pure bending: a strain of 0.02 y.
        x, y = X.T - 0.5
        return 0.02 * np.column_stack([x * y, -0.5 * x**2])

    shares, errors = {}, {}
    for name, u in (("checkerboard", checkerboard), ("bending", bending)):
        with recorded(builder, tmp_path / f"{name}.h5", u) as record:
            assert {"control a%2Fb share", "control a%2Fb error"} < set(record.field_names)
            assert record.units["control a%2Fb share"] == "-"
            inside = np.abs(record.particles.positions - 0.5).max(axis=1) < 0.25
            share = record.field("control a%2Fb share")[0]
            assert ((share >= 0.0) & (share <= 1.0)).all()
            shares[name], errors[name] = share, record.field("control a%2Fb error")[0]
    assert shares["checkerboard"][inside].min() > 0.9
    # In the middle neighbours along an axis move by 2e-3 sqrt(2) spacings against each other,
    # diagonal ones not at all.
    assert 1e-3 < errors["checkerboard"].max() < 2e-3 * np.sqrt(2.0)
    # Linear gradients are exact for quadratic fields where neighbours lie in pairs, and off by
    # half the strain's change over a support beside a surface.
    assert shares["bending"][inside].max() < 1e-6
    assert shares["bending"].max() < 1e-3
    assert errors["bending"][inside].max() < 1e-8
    assert errors["bending"].max() < 0.02 * 3 * spacing


def test_a_body_at_rest_has_no_share(tmp_path: Path) -> None:
    builder = box(2, 6).effect("hourglass-control")
    with recorded(builder, tmp_path / "rest.h5", np.zeros_like) as record:
        assert not record.field("hourglass-control share")[:].any()
        assert not record.field("hourglass-control error")[:].any()
    turned = np.array([[0.0, -1.0], [1.0, 0.0]]) - np.eye(2)
    with recorded(builder, tmp_path / "turned.h5", lambda X: X @ turned.T + 1e3) as record:
        assert not record.field("hourglass-control share")[0].any()
        # Places are rounded to 1e-13, a millionth of a millionth of a spacing.
        assert record.field("hourglass-control error")[0].max() < 1e-11


@pytest.mark.parametrize("gradient", ["corrected", "quadratic"])
@pytest.mark.parametrize(
    "d", [pytest.param(d, marks=() if d == 2 else pytest.mark.validation) for d in (1, 2, 3)]
)
def test_sweeps_products_and_the_matrix_are_the_same(d: int, gradient: str) -> None:
    """Three ways to the same force, with ghosts that are not penalised among the neighbours."""
    builder = (
        box(
            d,
            {1: 12, 2: 6, 3: 5}[d],
            discretisation={"type": "lattice", "ghost_faces": ["left"], "ghosts": 4},
        )
        .kernel("modified-mollifier", cover=3.5)
        .formulation("total-lagrangian", gradient=gradient)
        .boundary("symmetry", axis="x")
    )
    simulation = builder.build()
    assert simulation.particles.ghosts.any()
    (body,) = simulation.model.bodies
    u = random_motion(simulation) - simulation.particles.positions
    pairs = penalised(body, 0.3)
    products, sweeps = HourglassProducts.of(pairs), HourglassSweeps.of(pairs)
    expected = -(products.matrix() @ u)
    assert np.abs(expected[simulation.particles.ghosts]).max() > 0.0  # by the gradient's adjoint
    # Sums of some hundred terms in another order.
    allowed = 1e-12 * np.abs(expected).max()
    for operator in (products, sweeps):
        assert np.abs(operator.forces(u) - expected).max() < allowed
    state = attrs.evolve(simulation.initial, positions=simulation.particles.positions + u)
    H = simulation.dynamics.observe(state).deformation_gradients - np.eye(d)
    energy = 0.25 * pairs.squares(u, H).sum()
    assert energy == pytest.approx(-0.5 * float(np.vdot(u, expected)), rel=1e-12)
    total = sweeps.forces(u).sum(axis=0)
    assert np.abs(total).max() < 1e-14 * np.abs(expected).sum()


@examples(40)
@given(
    d=st.integers(1, 3),
    cells=st.integers(5, 8),
    kernel=st.sampled_from(
        [("modified-mollifier", 3.0), ("modified-mollifier", 5.5), ("cubic-spline", 2.6)]
    ),
    gradient=st.sampled_from(["corrected", "quadratic"]),
    amplitude=st.floats(0.0, 0.45),
)
def test_the_declared_stiffness_bounds_the_true_one_closely(
    d: int, cells: int, kernel: tuple[str, float], gradient: str, amplitude: float
) -> None:
    jittered = {"type": "jittered-lattice", "amplitude": amplitude, "seed": 1}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # few neighbours: a linear fit in places
        simulation = (
            box(d, min(cells, 6) if d == 3 else cells, discretisation=jittered)
            .kernel(kernel[0], cover=kernel[1])
            .formulation("total-lagrangian", gradient=gradient)
            .build()
        )
        bodies = simulation.model.bodies
        declared = HourglassControl(strength=0.3).bind(simulation.model, "").stiffness_rate
        K = HourglassProducts.of(penalised(bodies[0], 0.3)).matrix().toarray()
    scaling = 1.0 / np.sqrt(bodies[0].masses)
    true = np.sqrt(np.linalg.eigvalsh(scaling[:, None] * K * scaling)[-1])
    assert true <= declared <= 1.02 * true


def test_a_column_thrown_to_the_side_needs_it() -> None:
    """Particles stay where their neighbours go, as they do not with quadratic gradients alone."""

    def farthest(strength: float) -> float:
        builder = (
            Simulation.builder()
            .body("column", shape={"type": "box", "lengths": [1.0, 3.0]}, spacing=1.0 / 9)
            .kernel("modified-mollifier", cover=3.5)
            .material("neo-hookean", youngs_modulus=17e6, poissons_ratio=0.3, density=1100.0)
            .formulation("total-lagrangian", gradient="quadratic")
            .boundary("clamp", where="bottom")
            .initial(velocity={"x": "10*Y"})
            .duration(0.5)
        )
        if strength:
            builder = builder.effect("hourglass-control", strength=strength)
        simulation = builder.build()
        u = simulation.run().state.positions - simulation.particles.positions
        W = simulation.model.smoothing_matrix()
        away = u - W @ u / W.sum(axis=1)[:, None]
        return float(9.0 * np.linalg.norm(away, axis=1).max())

    # In spacings. A column bent that far is off by 0.12 from a smoothed one for its curvature.
    assert farthest(HourglassControl().strength) < 0.2
    assert farthest(0.0) > 1.0


@pytest.mark.parametrize("nu", [0.4, 0.4999])
def test_the_default_costs_little_accuracy_near_incompressibility_too(nu: float) -> None:
    """A penalty on volume would stiffen shear: a tenth of lambda + 2 mu costs 6 % at 0.4999."""

    def deflection(builder: SceneBuilder) -> float:
        simulation = builder.material(
            "saint-venant-kirchhoff", youngs_modulus=1.4e6, poissons_ratio=nu, density=1e3
        ).build()
        (tip,) = simulation.particles.tagged("tip")
        u = equilibrium(simulation).state.positions - simulation.particles.positions
        return float(u[tip, 1])

    free, held = deflection(beam(5, 0.5)), deflection(beam(5, 0.5).effect("hourglass-control"))
    # Measured at five particles across: -0.24 % and -0.47 %; at nine a half to a third of it.
    assert -0.006 < held / free - 1.0 < 0.0


def test_it_needs_the_reference_configuration() -> None:
    builder = box(2).formulation("updated-lagrangian").effect("hourglass-control")
    with pytest.raises(BuildError, match="use 'total-lagrangian'"):
        builder.build()


def test_it_shortens_the_step_as_it_stiffens() -> None:
    soft, stiff = (
        box(2).effect("hourglass-control", strength=s).duration(1.0).build().step_size
        for s in (0.1, 30.0)
    )
    assert stiff < 0.8 * soft
