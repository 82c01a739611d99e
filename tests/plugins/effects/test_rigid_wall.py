"""Rigid walls: a potential, at rest and moving; Coulomb's law with a spring that remembers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, Record, SceneError, Simulation
from solidsph.advice import advise
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium
from tests.helpers.scenes import box

FLOOR = {"point": {"y": 0.0}, "normal": {"y": 1.0}}


def dropped(d: int = 2, **wall: Any) -> SceneBuilder:
    """A scattered box that falls on a floor askew, and bounces."""
    return (
        box(d, 6, discretisation={"type": "jittered-lattice", "amplitude": 0.2, "seed": 2})
        .effect("rigid-wall", label="floor", **{**FLOOR, **wall})
        .initial(displacement={"y": 0.05}, velocity={"y": "-4 + X", "x": 1.0})
        .integrator("velocity-verlet", time_step_factor=0.5)
        .duration(0.08)
        .outputs(40)
    )


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("displacement", [None, {"y": "0.05*sin(40*t)", "x": "0.5*t"}])
def test_the_ledger_closes(friction: float, displacement: Any, tmp_path: Path) -> None:
    builder = dropped(friction=friction, displacement=displacement)

    def residual(factor: float) -> float:
        path = tmp_path / f"{factor}.h5"
        builder.integrator("velocity-verlet", time_step_factor=factor).build().run(record=path)
        with Record(path) as record:
            history = record.history
        assert history["floor touching particles [-]"].max() >= 3
        start = history["kinetic energy [J]"][0]
        left = float(np.abs(history["energy residual [J]"]).max() / start)
        lost = -history["work of floor [J]"] - history["floor energy [J]"]
        if displacement is None:
            # A wall at rest gives back what it stores, and friction only takes.
            assert np.diff(lost).min() >= -2.0 * left * start
            assert (lost[-1] > 0.02 * start) if friction else (lost[-1] < 2.0 * left * start)
        return left

    coarse, fine = residual(0.2), residual(0.1)
    # By the square of the step, from 1 % at half the CFL step of these 36 particles, thrown at a
    # tenth of the wave speed; kinks of springs that give way let the power waver.
    assert coarse < 2.5e-3
    assert coarse / fine > 2.5


def test_a_moving_wall_is_a_moving_frame() -> None:
    """What a wall with a constant velocity does to a body is what a wall at rest does to one that
    comes with the opposite velocity, friction included."""
    runs = []
    for mine, walls in ((3.0, 0.0), (0.0, 3.0)):
        simulation = (
            box(2, 6)
            .effect(
                "rigid-wall",
                **FLOOR,
                friction=0.4,
                displacement={"y": f"{walls}*t", "x": f"-{walls}*t"},
            )
            .initial(velocity={"y": -mine, "x": mine})
            .duration(0.03)
            .build()
        )
        state = simulation.run().state
        runs.append(state.velocities + np.array([walls, -walls]))
    # Positions of metres, in steps of 1e-3 s: the motion of the plane is a difference of formulas.
    assert np.abs(runs[0] - runs[1]).max() < 1e-9 * np.abs(runs[0]).max()


def test_a_block_below_the_angle_of_friction_stands_and_does_not_creep() -> None:
    """Pushed with less than f N it leans on its springs, and comes to rest by its own damping."""

    def way(push: float) -> tuple[float, float]:
        simulation = (
            box(2, 6)
            .effect("body-force", label="weight", acceleration={"y": "-10*min(t/0.1, 1)"})
            .effect("body-force", label="push", acceleration={"x": f"{push}*min(t/0.1, 1)"})
            .effect("rigid-wall", **FLOOR, friction=0.5)
            .effect("mass-damping", rate=30.0)
            .duration(0.9)
            .build()
        )
        loop, state = simulation.time_loop(), simulation.start()
        X = simulation.particles.positions
        moved = []
        for part in (0.66, 1.0):
            state = loop.advance(state, round(part * simulation.steps))
            moved.append(float((state.positions - X)[:, 0].mean()))
        return moved[0], moved[1] - moved[0]

    stays, creeps = way(4.5)
    # It leans by rho g H^2 / (3 mu), 4 mm, and by its springs, less than that.
    assert 0.0 < stays < 0.01
    assert abs(creeps) < 1e-3 * stays
    assert way(5.5)[1] > 1e-3


def test_friction_survives_a_restart_to_the_bit() -> None:
    simulation = dropped(friction=0.5).build()
    whole = simulation.run().state
    assert np.abs(whole.memory["floor slip"]).shape == (36, 2)
    middle = simulation.time_loop().advance(simulation.start(), simulation.steps // 3)
    assert np.abs(middle.memory["floor slip"]).max() > 0.0
    again = dropped(friction=0.5).build()
    ended = again.time_loop().advance(middle, again.steps)
    assert np.array_equal(whole.positions, ended.positions)
    assert np.array_equal(whole.memory["floor slip"], ended.memory["floor slip"])


def test_newton_finds_a_block_at_rest_on_it() -> None:
    """The pressure of a block held from above is that of its weight; its tangent is the
    derivative of its force."""
    simulation = (
        box(2, 6)
        .boundary("prescribed-motion", where="top", displacement={"y": -0.01})
        .boundary("clamp", where="top", axes=["x"])
        .effect("rigid-wall", **FLOOR, strength=2.0, label="floor")
        .statics()
        .build()
    )
    found = equilibrium(simulation)
    assert found.residual < 1e-9
    floor, top = found.state.applied["floor"], found.state.applied["prescribed-motion top"]
    assert floor[:, 1].sum() == pytest.approx(-top[:, 1].sum(), rel=1e-8)
    (load,) = simulation.dynamics.loads
    u = found.state.positions - simulation.particles.positions
    du = 1e-6 * np.random.default_rng(0).standard_normal(u.shape)
    X, rest = simulation.particles.positions, np.zeros_like(u)
    change = load.forces(0.0, X + u + du, rest) - load.forces(0.0, X + u - du, rest)
    expected = -2.0 * (load.stiffness(u, 0.0) @ du.ravel()).reshape(du.shape)  # type: ignore[attr-defined]
    assert np.abs(change - expected).max() <= 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        ({"normal": {"y": 0.0}}, "no length"),
        ({"normal": {"z": 1.0}}, "'z' in a 2D scene"),
        ({"normal": [0.0, 1.0]}, "table of numbers"),
        ({"point": {"y": "0.1"}}, "table of numbers"),
        ({"friction": -1.0}, "between 0 and 100"),
        ({"clearance": float("nan")}, "between 0 and 100"),
        ({"strength": 0.0}, "positive"),
        ({"displacement": {"z": "t"}}, "component 'z'"),
        ({"displacement": {"y": "1/t"}}, "finite"),
    ],
)
def test_what_cannot_be_is_refused_with_its_remedy(wall: Any, words: str) -> None:
    with pytest.raises((BuildError, SceneError), match=words):
        box(2).effect("rigid-wall", **{**FLOOR, **wall}).build()


ON_BOUNDARY = {"type": "lattice", "on_boundary": True}
JITTERED = {"type": "jittered-lattice", "amplitude": 0.25, "seed": 3}


@pytest.mark.parametrize("discretisation", ["lattice", ON_BOUNDARY, "conforming-lattice", JITTERED])
@pytest.mark.parametrize("height", [0.25, 0.34, 0.4, 0.45])
def test_a_body_touches_where_its_surface_is(height: float, discretisation: Any) -> None:
    """Flush with the wall nothing pushes, also where the spacing does not divide the body, so
    that rows lie closer than a spacing (three in 0.25 m of 0.1 m). Pressed on, the wall pushes."""
    simulation = (
        Simulation.builder()
        .body(
            "block",
            shape={"type": "box", "lengths": [1.0, height]},
            spacing=0.1,
            discretisation=discretisation,
        )
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .effect("rigid-wall", **FLOOR)
        .duration(0.01)
        .build()
    )
    wall = simulation.terms[0]
    X = simulation.particles.positions

    def pressure(moved: float) -> float:
        return float(wall.forces(0.0, X - [0.0, moved], np.zeros_like(X))[:, 1].sum())  # type: ignore[attr-defined]

    # Rounding of positions of a metre, by the modulus of 1.35 MPa over a spacing.
    assert pressure(0.0) <= 1e-8
    assert pressure(0.01) > 1e4


@pytest.mark.parametrize(
    ("gap", "heard"), [({"y": 0.0}, False), ({"y": -0.05}, False), ({"y": -100.0}, True)]
)
def test_a_body_that_falls_on_a_wall_is_held(gap: dict[str, float], heard: bool) -> None:
    """It falls 20 m in 2 s: on a wall within that way, and on none that is further away."""
    simulation = (
        box(2, 5)
        .effect("rigid-wall", point=gap, normal={"y": 1.0})
        .effect("body-force", acceleration={"y": -10.0})
        .duration(2.0)
        .build()
    )
    assert ("unheld" in {one.name for one in advise(simulation)}) == heard


def test_a_disc_touches_at_its_lowest_point() -> None:
    """Where particles of its lowest row of a lattice are less than half a spacing deep."""
    simulation = (
        Simulation.builder()
        .body("disc", shape={"type": "disc", "radius": 0.33, "centre": [0.0, 0.33]}, spacing=0.1)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .effect("rigid-wall", **FLOOR)
        .duration(0.01)
        .build()
    )
    wall = simulation.terms[0]
    X = simulation.particles.positions
    # Rounding, as above. Where rows are closer than a spacing, half of one is more than there is.
    assert np.abs(wall.forces(0.0, X, np.zeros_like(X))).max() <= 1e-8  # type: ignore[attr-defined]


def test_a_bar_thrown_at_a_wall_comes_back() -> None:
    """After 2 L / c with the opposite velocity, but for what the front sheds."""
    simulation: Simulation = (
        box(1, 60)
        .effect("rigid-wall", point={"x": 0.0}, normal={"x": 1.0})
        .initial(velocity={"x": -0.1})
        .duration(2.5 / 36.7)
        .build()
    )
    assert simulation.run().state.velocities.mean() == pytest.approx(0.1, rel=0.03)


def test_no_step_changes_no_memory() -> None:
    """An integrator begins by asking without a step: springs stay, even where nothing presses."""
    simulation = dropped(friction=0.5).build()
    (load,) = simulation.dynamics.loads
    x = simulation.particles.positions + 1.0
    slip = np.full((len(x), 2), 0.01)
    _, memory = load.advance(0.0, 0.0, x, np.zeros_like(x), {"floor slip": slip})
    assert np.array_equal(memory["floor slip"], slip)
