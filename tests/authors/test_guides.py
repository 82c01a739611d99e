"""The pages for authors of parts: their code is installed as a third party's, checked and run."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from solidsph import BuildError, Scene, Simulation
from solidsph.parts import construct, memory_name
from solidsph.registry import registry
from solidsph.run.energy import kinetic_energy
from solidsph.run.step_by_step import StepByStep
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.case_run import run_case
from tests.helpers.guides import DOCS, Guide
from tests.helpers.scenes import SOFT, box

PAGES = sorted(path.stem for path in DOCS.glob("first-*.md"))
GUIDES = [page for page in PAGES if page != "first-kernel"]  # that one has a distribution of files

# What a page leaves out of its scene.
REST: Mapping[str, Any] = {
    "duration": 6e-3,
    "outputs": 2,
    "body": {"block": {"shape": {"type": "box", "lengths": [1.0, 1.0]}, "spacing": 0.125}},
    "material": {"type": "neo-hookean", **SOFT},
    "initial": [{"velocity": {"x": "0.1*Y", "y": "0.1*sin(3*X)"}}],
}


@pytest.fixture
def guide(foreign) -> Callable[[str], Guide]:
    """Installs the parts of a page."""

    def installed(page: str) -> Guide:
        found = Guide.read(page)
        found.install(foreign)
        return found

    return installed


def bar(cells: int = 10, length: float = 1.0, **body: Any) -> SceneBuilder:
    """A bar in one dimension, with particles on both ends, and nothing else."""
    shape = {"type": "interval", "length": length}
    lattice = {"type": "lattice", "on_boundary": True}
    return Simulation.builder().body(
        "bar", shape=shape, spacing=length / cells, discretisation=lattice, **body
    )


def test_every_kind_of_part_has_its_page() -> None:
    text = (DOCS / "authors.md").read_text(encoding="utf-8")
    kinds = [*registry.INTERFACES, registry.HOOKS]
    assert [kind for kind in kinds if f"`{registry.PREFIX}{kind}`" not in text] == []
    assert [page for page in PAGES if f"({page}.md)" not in text] == []


@pytest.mark.parametrize("page", GUIDES)
def test_its_parts_import_from_one_place(page: str) -> None:
    for source in Guide.read(page).modules.values():
        nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
        of_solidsph = {node.module for node in nodes if str(node.module).startswith("solidsph")}
        assert of_solidsph == {"solidsph.parts"}


@pytest.mark.parametrize("page", GUIDES)
def test_its_test_passes(page: str, guide) -> None:
    names: dict[str, Any] = {}
    exec(compile(guide(page).test, f"{page}.md", "exec"), names)
    tests = [value for name, value in names.items() if name.startswith("test_")]
    assert tests
    for test in tests:
        test()


@pytest.mark.parametrize("page", [page for page in GUIDES if Guide.read(page).scenes])
def test_its_scene_uses_the_part_and_runs(page: str, guide) -> None:
    found = guide(page)
    names = {name for entries in found.points.values() for name in entries}
    used: set[str] = set()
    for piece in found.scenes:
        scene = Scene.from_toml(tomli_w.dumps({**REST, **piece}))
        simulation = Simulation.builder(scene).build()
        used |= {entry.name for entry in simulation.parts}
        assert simulation.run().state.step > 1
    assert names <= used


def test_foam_stretches_as_its_law_says(guide) -> None:
    """A bar that cannot move sideways has P = mu (1 - stretch^-3)."""
    guide("first-material")
    mu = 1e5
    state = (
        bar()
        .material("foam", shear_modulus=mu, density=200.0)
        .formulation("total-lagrangian", gradient="consistent")
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": 0.5 * mu})
        .statics(load_steps=4)
        .duration(1.0)
        .build()
        .run()
        .state
    )
    # Newton's method ends at 1e-9 of the load.
    assert np.ptp(state.positions) == pytest.approx(0.5 ** (-1.0 / 3.0), rel=1e-8)


def test_foam_softens_by_what_it_has_seen(guide) -> None:
    """Pulled to a stretch and let back, uniformly: the damage is that of the peak."""
    guide("first-history-material")
    material = construct(
        "materials", {"type": "softening-foam", "shear_modulus": 1e5, "density": 200.0}
    )
    simulation = (
        bar()
        .material(material)
        .boundary(
            "prescribed-motion", where="all", displacement={"x": "0.15*X*(1 - cos(pi*t/0.01))"}
        )
        .integrator("velocity-verlet", time_step_factor=0.1)
        .duration(0.02)
        .outputs(4)
        .build()
    )
    state = simulation.run().state
    history = state.memory[memory_name(simulation.model.bodies[0])]
    peak = material.energy(((1.3,),), material.params)
    # A step is at the peak to the square of half a step over the duration, and psi is flat there.
    assert history[:, 0] == pytest.approx(peak, rel=1e-3)
    assert history[:, 1] == pytest.approx(0.5 * (1.0 - np.exp(-history[:, 0] / 1e4)), rel=1e-12)


def test_a_body_at_rest_turns_backwards_in_a_turning_frame(guide) -> None:
    guide("first-effect")
    w, time = 20.0, 0.05
    simulation = (
        box(2)
        .effect("turning-frame", rate=w)
        .initial(velocity={"x": f"{w}*Y", "y": f"-{w}*X"})
        .integrator("velocity-verlet", time_step_factor=0.1)
        .duration(time)
        .build()
    )
    state, X = simulation.run().state, simulation.particles.positions
    c, s = cos(w * time), sin(w * time)
    expected = X @ np.array([[c, -s], [s, c]])
    # Velocities are predicted by one step, of the second order: (w dt)^2 with w dt = 0.006.
    assert np.abs(state.positions - expected).max() < 1e-3


def test_two_bodies_on_a_tether_swing_about_each_other(guide) -> None:
    """Each moves as a rigid body: d(t) = d(0) cos(w t), w^2 = k (1 / m + 1 / M)."""
    guide("first-general-effect")
    k, time = 2e4, 0.05
    simulation = (
        bar(5)
        .body("other", shape={"type": "interval", "length": 2.0, "origin": 5.0}, spacing=0.2)
        .material("neo-hookean", **SOFT)
        .effect("tether", stiffness=k, where="bar", other="other")
        .duration(time)
        .build()
    )
    state, masses = simulation.run().state, simulation.model.masses
    own = simulation.particles.bodies["bar"], simulation.particles.bodies["other"]
    middles = [np.average(state.positions[o, 0], weights=masses[o]) for o in own]
    m, M = (masses[o].sum() for o in own)
    expected = (6.0 - 0.5) * cos(sqrt(k * (1.0 / m + 1.0 / M)) * time)
    # The frequency errs by (w dt)^2 / 24, with w dt = 0.02.
    assert middles[1] - middles[0] == pytest.approx(expected, abs=1e-3)


def test_two_particles_on_a_spring_vibrate(guide) -> None:
    """The material is next to nothing: w^2 = 2 k / m."""
    guide("first-pair-term")
    k, amplitude = 50.0, 0.1
    builder = (
        Simulation.builder()
        .scheme("corrected")  # cells: two particles
        .body("pair", shape={"type": "interval", "length": 1.0}, spacing=0.5)
        .kernel("modified-mollifier", cover=3.0)
        .material("linear-elastic", youngs_modulus=1e-6, poissons_ratio=0.0, density=1.0)
        .effect("springs", stiffness=k)
        .initial(displacement={"x": f"{amplitude}*(2*X - 1)"})
        .duration(1.0)
    )
    simulation = builder.integrator("central-difference", time_step=1e-3).build()
    state = simulation.run().state
    x = state.positions[:, 0]
    stretch = amplitude * cos(sqrt(2.0 * k / 0.5) * state.time)
    # A particle of half the bar has its mass, 0.5. The frequency errs by (w dt)^2 / 24 = 8e-6.
    assert abs(x[1] - x[0]) - 0.5 == pytest.approx(stretch, abs=1e-4)


def test_hexagons_see_a_uniform_strain(guide) -> None:
    guide("first-discretisation")
    simulation = (
        Simulation.builder()
        .body(
            "block",
            shape={"type": "box", "lengths": [1.0, 0.8]},
            spacing=0.05,
            discretisation="hexagons",
        )
        .material("neo-hookean", **SOFT)
        .boundary("prescribed-motion", where="all", displacement={"x": "0.2*X + 0.1*Y", "y": 0})
        .duration(1e-3)
        .build()
    )
    positions = simulation.particles.positions
    nearest = np.sort(np.linalg.norm(positions[:, None] - positions, axis=2), axis=1)[:, 6]
    assert np.mean(nearest < 0.06) > 0.7  # six of them, but for those near the surface
    observed = simulation.dynamics.observe(simulation.run().state)
    assert np.abs(observed.deformation_gradients - [[1.2, 0.1], [0.0, 1.0]]).max() < 1e-10


def test_a_stadium_has_its_moment_of_inertia(guide) -> None:
    guide("first-shape")
    length, r, rho, w = 1.0, 0.25, 1000.0, 10.0
    simulation = (
        Simulation.builder()
        .body("slab", shape={"type": "stadium", "length": length, "radius": r}, spacing=0.025)
        .material("neo-hookean", **SOFT)
        .initial(velocity={"x": f"-{w}*Y", "y": f"{w}*(X - 0.5)"})
        .duration(2e-3)
        .build()
    )
    slab = rho * 2.0 * r * length * (length**2 + 4.0 * r**2) / 12.0
    ends = rho * pi * r**2 * (0.5 * r**2 + (0.5 * length) ** 2 + 4.0 / (3.0 * pi) * r * length)
    energy = kinetic_energy(simulation.dynamics.observe(simulation.run().state))
    # Round ends in particles of a tenth of the radius, and what it spends on swelling.
    assert energy == pytest.approx(0.5 * (slab + ends) * w**2, rel=0.01)


def test_semi_implicit_euler_falls_by_a_sum(guide) -> None:
    """After n steps by g dt^2 n (n + 1) / 2, exactly."""
    guide("first-integrator")
    simulation = (
        bar()
        .material("neo-hookean", **SOFT)
        .effect("body-force", acceleration={"x": -10.0})
        .integrator("semi-implicit-euler")
        .energy_tolerance("off")
        .duration(0.05)
        .build()
    )
    state = simulation.run().state
    n, dt = state.step, simulation.step_size
    fallen = simulation.particles.positions - state.positions
    assert fallen == pytest.approx(10.0 * dt**2 * n * (n + 1) / 2.0, rel=1e-9)


def test_a_turning_clamp_turns(guide) -> None:
    guide("first-boundary")
    rate = 5.0
    simulation = (
        box(2)
        .boundary("turning-clamp", where="left", rate=rate, centre=[0.0, 0.5])
        .initial(velocity={"x": f"-{rate}*(Y - 0.5)", "y": f"{rate}*X"})
        .duration(0.05)
        .build()
    )
    state, held = simulation.run().state, simulation.model.select("left")
    c, s = cos(rate * state.time), sin(rate * state.time)
    arms = simulation.particles.positions[held] - [0.0, 0.5]
    expected = arms @ np.array([[c, s], [-s, c]]) + [0.0, 0.5]
    assert np.abs(state.positions[held] - expected).max() < 1e-12


def test_a_row_of_particles_has_a_regularised_gradient(guide) -> None:
    """A single row in the plane, whose moments have no inverse."""
    guide("first-gradient")

    def row(gradient: str) -> SceneBuilder:
        shape = {"type": "box", "lengths": [1.0, 0.1]}
        return (
            Simulation.builder()
            .scheme("corrected")
            .body("row", shape=shape, spacing=0.1)
            .material("neo-hookean", **SOFT)
            .formulation("total-lagrangian", gradient=gradient)
            .duration(1e-3)
        )

    with pytest.raises(BuildError, match="do not span 2 dimensions"):
        row("corrected").build()
    simulation = row("regularised").build()
    H = simulation.dynamics.internal.gradients(0.1 * simulation.particles.positions)
    # Exact to a thousandth over the moment along the row, which is at least 0.1.
    assert H[:, 0, 0] == pytest.approx(0.1, rel=1e-2)
    assert np.abs(H[:, 0, 1]).max() == 0.0


def test_the_hanging_bar_hangs(guide, tmp_path: Path) -> None:
    guide("first-case")
    errors = []
    for particles in (10, 20):
        case = construct("cases", {"type": "hanging-bar", "particles": particles})
        result = run_case(case, tmp_path / str(particles))
        assert result.passed
        errors.append(result.measurements[0].error)
    assert errors[1] < errors[0]


def test_an_installed_hook_hears_every_run(guide) -> None:
    guide("first-hook")
    simulation = bar().material("neo-hookean", **SOFT).initial(velocity={"x": 3.0}).duration(1e-3)
    built = simulation.build()
    built.run()
    from peak_speed import listener

    assert listener.peaks[built] == pytest.approx(3.0, rel=1e-9)


@pytest.mark.validation  # some ten seconds of compiling
def test_their_formulas_compile(guide) -> None:
    """Whole steps, from output to output, as step by step."""
    for page in ("first-material", "first-effect", "first-integrator", "first-boundary"):
        guide(page)
    simulation = (
        box(2)
        .material("foam", shear_modulus=1e5, density=200.0)
        .effect("turning-frame", rate=20.0)
        .boundary("turning-clamp", where="left", rate=5.0, centre=[0.0, 0.5])
        .integrator("semi-implicit-euler", time_step_factor=0.1)
        .engine("compiled")
        .build()
    )
    assert simulation.plan.compiles_steps
    start, stop = simulation.start(), simulation.steps
    compiled = simulation.time_loop().advance(start, stop)
    plain = StepByStep(simulation.dynamics, simulation.integrator).advance(start, stop)
    # Both add the same numbers in other orders.
    assert np.abs(compiled.positions - plain.positions).max() < 1e-12
    assert np.ptp(compiled.velocities) > 1.0
