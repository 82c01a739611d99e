"""Equilibria of bodies that touch: tangents, closed forms, and friction that sticks or slides."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from solidsph import Simulation
from solidsph.errors import ConvergenceError
from solidsph.interfaces.memory import NOTHING
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium
from solidsph.statics.stiff import is_stiff_in_steps
from tests.helpers.scenes import SOFT, box, touching

E, NU = SOFT["youngs_modulus"], SOFT["poissons_ratio"]
CONFINED = E * (1.0 - NU) / (1.0 + NU) / (1.0 - 2.0 * NU)
MU = 0.3


@cache
def pressed(d: int, friction: float, wall: bool) -> BuiltScene:
    """Two boxes side by side, or one beside a wall that is aslant."""
    if not wall:
        return touching(d, 4).effect({"type": "contact", "friction": friction}).build()
    aslant = {"x": 1.0, "y": 0.3} if d > 1 else {"x": 1.0}
    return (
        box(d, 4)
        .effect({"type": "rigid-wall", "point": {"x": 0.1}, "normal": aslant, "friction": friction})
        .build()
    )


class Step:
    """A load step of a scene with one load, from random displacements to others."""

    def __init__(self, scene: BuiltScene, seed: int, slip: float) -> None:
        (self.load,) = scene.dynamics.loads
        self.X, self.time, self.step = scene.particles.positions, 0.4, 0.3
        self.random = np.random.default_rng(seed)
        self.end = 0.02 * self.any()
        self.end[self.X[:, 0] > 1.0, 0] -= 0.15
        self.start = self.end + slip * self.any()
        moving = 0.1 * slip * self.any()
        _, self.memory = self.load.advance(0.1, 0.1, self.X + self.start, moving, NOTHING)

    def any(self) -> Array:
        return self.random.standard_normal(self.X.shape)

    def forces(self, u: Array) -> Array:
        forces = np.zeros_like(u)
        v = (u - self.start) / self.step
        own, _ = self.load.advance(self.time, self.step, self.X + u, v, self.memory)
        forces[self.load.particles] = own
        return forces

    def error(self) -> float:
        """Of the stiffness along a random motion, by differences of the forces.

        A particle may begin to touch or to slide within the first difference; hardly within both.
        """
        load: Load | object = self.load
        assert is_stiff_in_steps(load)
        v = (self.end - self.start) / self.step
        K = load.stiffness_of_step(self.time, self.step, self.end, v, self.memory)
        du = self.any()
        assert K is not None
        return min(self._missed(K, du, h) for h in (1e-7, 1e-8))

    def _missed(self, K: Any, du: Array, h: float) -> float:
        measured = (self.forces(self.end - h * du) - self.forces(self.end + h * du)) / (2.0 * h)
        assert measured.any()
        wrong = (K @ du.ravel()).reshape(du.shape) - measured
        return float(np.linalg.norm(wrong) / np.linalg.norm(measured))


@settings(max_examples=12, deadline=None)
@given(d=st.integers(1, 3), wall=st.booleans(), seed=st.integers(0, 10**6))
def test_normal_stiffness_is_minus_the_derivative(d: int, wall: bool, seed: int) -> None:
    # A particle may begin to touch within the difference of 1e-7.
    assert Step(pressed(d, 0.0, wall), seed, 0.01).error() < 1e-5


@settings(max_examples=12, deadline=None)
@given(d=st.integers(2, 3), friction=st.sampled_from([0.01, 0.5, 50.0]), seed=st.integers(0, 10**6))
@example(d=2, friction=0.01, seed=3879)  # one begins to slide within 1e-7
def test_stiffness_of_friction_is_minus_the_derivative(d: int, friction: float, seed: int) -> None:
    assert Step(pressed(d, friction, True), seed, 0.01).error() < 1e-5
    # Beside another body normals count as constant, which is as wrong as springs are stretched.
    step = Step(pressed(d, friction, False), seed, 1e-4)
    assert step.error() < 0.01


def solid(name: str = "block", material: str = "neo-hookean", **body: object) -> SceneBuilder:
    return Simulation.builder().body(name, **body).material(material, **SOFT).duration(1.0)


def stacked(d: int, load: float, gap: float = 0.0) -> SceneBuilder:
    """Two boxes one behind the other along x, of which only contact holds the second in x."""
    size, cells = [1.0] * d, 6
    scene = solid(shape={"type": "box", "lengths": size}, spacing=1.0 / cells).body(
        "other",
        shape={"type": "box", "lengths": size, "origin": [1.0 + gap] + [0.0] * (d - 1)},
        spacing=1.0 / cells,
    )
    for axis, face in {"y": "bottom", "z": "front"}.items():
        if d > "xyz".index(axis):
            scene = scene.boundary("prescribed-motion", where=face, displacement={axis: "0"})
    return (
        scene.effect("contact")
        .boundary("prescribed-motion", where="block.left", displacement={"x": "0"}, label="foot")
        .boundary("traction", where="other.right", traction={"x": -load})
        .statics()
    )


@pytest.mark.parametrize(
    ("d", "load", "gap"),
    [
        (2, 5e4, 0.0),
        (2, 1.0, 0.0),
        (2, 5e4, 0.01),
        pytest.param(3, 5e4, 0.0, marks=pytest.mark.validation),
    ],
)
def test_a_body_that_only_contact_holds_is_found(d: int, load: float, gap: float) -> None:
    """From the first touch on, at small and at large loads, by both solvers."""
    result = equilibrium(stacked(d, load, gap).build())
    assert result.state.applied["foot"][:, 0].sum() == pytest.approx(load, rel=1e-7)
    assert (result.products > 0) == (d == 3)  # by iteration in space
    assert len(result.steps) == 1
    assert result.iterations <= 9


def test_the_stress_passes_from_block_to_block() -> None:
    load = 5e3
    scene = stacked(2, load).build()
    result = equilibrium(scene)
    X = scene.particles.positions
    H = scene.dynamics.internal.gradients(result.state.positions - X)
    far = np.abs(X[:, 0] - 1.0) > 0.6
    # In plane strain with free sides. Edges of the face between the blocks carry less.
    assert H[far, 0, 0] == pytest.approx(-load * (1.0 - NU**2) / E, rel=0.04)


def test_a_body_that_is_pulled_off_is_told() -> None:
    with pytest.raises(ConvergenceError, match="meets nothing that holds it"):
        equilibrium(stacked(2, -1e3).build())


@pytest.mark.parametrize("d", [2, 3])
def test_a_block_on_a_wall_is_uniform(d: int) -> None:
    pressure = 1e4
    scene = solid(
        material="linear-elastic", shape={"type": "box", "lengths": [1.0] * d}, spacing=0.125
    )
    if d == 3:
        scene = scene.boundary("prescribed-motion", where="front", displacement={"z": "0"})
    built = (
        scene.effect("rigid-wall", point={"y": 0.0}, normal={"y": 1.0}, label="floor")
        .boundary("prescribed-motion", where="left", displacement={"x": "0"})
        .boundary("traction", where="top", traction={"y": -pressure})
        .statics()
        .build()
    )
    result = equilibrium(built)
    X = built.particles.positions
    u = result.state.positions - X
    assert result.state.applied["floor"][:, 1].sum() == pytest.approx(pressure, rel=1e-8)
    top, bottom = X[:, 1] > 0.999, X[:, 1] < 0.001
    strain = pressure / E * (1.0 - NU**2 if d == 2 else 1.0)
    # The springs of particles at edges are a little softer.
    assert u[bottom, 1].mean() - u[top, 1].mean() == pytest.approx(strain, rel=2e-3)
    # Three quarters of the confined modulus over a spacing: a surface particle has 3/8 of a cell.
    assert u[bottom, 1] == pytest.approx(-pressure * 0.125 / (0.75 * CONFINED), rel=0.08)


def dragged(d: int, wall: bool, drawn: float, solver: str = "automatic") -> tuple[float, float]:
    """Friction along, and pressure across, on a block that is pressed down, then drawn aside."""
    size = [1.0] * d
    size[1] = 0.5
    scene = solid(shape={"type": "box", "lengths": size}, spacing=0.125 if d == 2 else 1 / 6)
    if wall:
        scene = scene.effect("rigid-wall", point={"y": 0}, normal={"y": 1}, friction=MU)
    else:
        plate = [2.0] * d
        plate[1] = 0.5
        scene = (
            scene.body(
                "plate",
                shape={"type": "box", "lengths": plate, "origin": [-0.5] * d},
                spacing=0.125 if d == 2 else 1 / 6,
            )
            .boundary("clamp", where="plate.bottom")
            .effect("contact", friction=MU)
        )
    aside = {"z": "0"} if d == 3 else {}
    motion = {"x": f"{drawn}*max(t - 0.5, 0)", "y": "-0.005*min(2*t, 1)", **aside}
    built = (
        scene.boundary("prescribed-motion", where="block.top", displacement=motion, label="push")
        .statics(load_steps=4)
        .build()
    )
    result = equilibrium(built, load_steps=4, solver=solver)
    assert result.iterations <= 8 * len(result.steps)
    (load,) = built.dynamics.loads
    x, block = result.state.positions, built.model.bodies[0].extent
    normal, applied = np.zeros_like(x), result.state.applied
    normal[load.particles] = load.forces(0.0, x, np.zeros_like(x))
    # An edge that digs into a plate carries force by its side, too.
    friction = (applied[load.label] - normal)[block].sum(axis=0)
    np.testing.assert_allclose(
        applied[load.label][block].sum(axis=0), -applied["push"].sum(axis=0), rtol=1e-6, atol=1e-4
    )
    return -float(friction[0]), float(normal[block, 1].sum())


@pytest.mark.parametrize(
    ("wall", "solver"), [(True, "direct"), (True, "iterative"), (False, "direct")]
)
def test_friction_reaches_coulombs_limit_and_no_more(wall: bool, solver: str) -> None:
    along, across = dragged(2, wall, 0.1, solver)
    assert along / across == pytest.approx(MU, rel=1e-6)


@pytest.mark.parametrize("wall", [True, False])
def test_a_block_that_sticks_is_sheared_with_its_springs(wall: bool) -> None:
    drawn = 0.002
    along, across = dragged(2, wall, drawn)
    assert 0.0 < along < 0.3 * MU * across
    # Twice as far, twice the force.
    assert dragged(2, wall, 0.5 * drawn)[0] == pytest.approx(0.5 * along, rel=0.02)


@pytest.mark.validation
def test_friction_in_space() -> None:
    along, across = dragged(3, False, 0.1)
    assert along / across == pytest.approx(MU, rel=0.01)  # edges turn about two axes


def hertz(
    d: int, spacing: float, approach: float, *, wall: bool, **body: object
) -> tuple[float, float, float]:
    """Load P, half-width over that of Hertz, and P over Hertz's load for this approach (in space).

    Half a disc or ball of radius 1 on a wall, or on another; one quadrant is simulated. The width
    is that of Hertz's pressures with the second moment of the forces that act.
    """

    def part(sign: int) -> dict[str, object]:
        more = [6.0] * (d - 2), [-3.0] * (d - 2)
        cuts = [
            {"lengths": [3.0, 6.0, *more[0]], "origin": [-3.0, -3.0, *more[1]]},
            {
                "lengths": [6.0, 3.0, *more[0]],
                "origin": [-3.0, 2.5 * sign - 1.5, *more[1]],
            },
            {"lengths": [6.0, 6.0, 3.0], "origin": [-3.0, -3.0, -3.0]},
        ]
        of = {"type": "disc" if d == 2 else "ball", "radius": 1.0, "centre": [0, sign, 0][:d]}
        return {"type": "difference", "of": of, "minus": [{"type": "box", **c} for c in cuts[:d]]}

    scene = solid("high", shape=part(1), spacing=spacing, **body)
    if wall:
        scene = scene.effect("rigid-wall", point={"y": 0}, normal={"y": 1}, label="touch")
    else:
        scene = (
            scene.body("low", shape=part(-1), spacing=spacing, **body)
            .effect("contact", label="touch")
            .boundary("prescribed-motion", where="low and Y < -0.9999", displacement={"y": "0"})
        )
    for axis in ("x", "z")[: d - 1]:
        where = f"{axis.upper()} < 1e-9"
        scene = scene.boundary("prescribed-motion", where=where, displacement={axis: "0"})
    motion = {"y": f"-{approach}*t"}
    built = (
        scene.boundary("prescribed-motion", where="high and Y > 0.9999", displacement=motion)
        .statics()
        .build()
    )
    result = equilibrium(built)
    assert result.iterations <= (10 if d == 2 else 16)
    # A refined ball has a tangent that is not positive on a wall, too, however lightly pressed.
    assert result.stable or (d == 3 and body)
    high = built.model.bodies[0].extent
    force, x = result.state.applied["touch"][high, 1], result.state.positions[high]
    P = float(force.sum()) * 2.0 ** (d - 1)
    across = np.delete(x, 1, axis=1)
    moment = float(force @ np.sum(across**2, axis=1) / force.sum())
    modulus, radius = E / (1.0 - NU**2) * (1.0 if wall else 0.5), 1.0 if wall else 0.5
    if d == 2:
        return P, 2.0 * moment**0.5 / (4.0 * P * radius / (np.pi * modulus)) ** 0.5, np.nan
    width = (0.75 * P * radius / modulus) ** (1 / 3)
    load = 4.0 / 3.0 * modulus * (radius * approach**3) ** 0.5
    return P, (2.5 * moment) ** 0.5 / width, P / load


@pytest.mark.parametrize("wall", [True, False])
def test_a_cylinder_is_flat_where_hertz_says(wall: bool) -> None:
    """Hertz (1882): a^2 = 4 P R / (pi E*); four to six spacings, a fifth of the radius."""
    _, width, _ = hertz(2, 0.05, 0.1, wall=wall)
    assert width == pytest.approx(1.0, abs=0.03)


@pytest.mark.validation
def test_a_ball_is_pressed_as_hertz_says() -> None:
    """P = 4/3 E* sqrt(R d^3); the half ball is finite, and flat over a third of its radius."""
    _, width, load = hertz(3, 0.07, 0.1, wall=True)
    assert width == pytest.approx(1.0, abs=0.08)
    assert load == pytest.approx(1.0, abs=0.08)


@pytest.mark.validation
def test_finer_cylinders_are_closer_to_hertz() -> None:
    _, width, _ = hertz(2, 0.025, 0.05, wall=False)
    assert width == pytest.approx(1.0, abs=0.015)


def finer(where: str, spacing: float, over: float) -> dict[str, object]:
    return {"refine": [{"where": where, "spacing": spacing, "over": over}]}


def test_refined_cylinders_are_flat_where_hertz_says() -> None:
    """Four times finer where they touch: a quarter of the particles of a fine body."""
    words = finer("hypot(X, Y) < 0.25", 0.025, 0.6)
    _, width, _ = hertz(2, 0.1, 0.05, wall=False, **words)
    assert width == pytest.approx(1.0, abs=0.015)  # as with one spacing, below


@pytest.mark.validation
def test_refined_cylinders_are_as_good_as_fine_ones() -> None:
    """With 1 835 particles instead of 10 344."""
    words = finer("hypot(X, Y) < 0.2", 0.0125, 0.5)
    refined, width, _ = hertz(2, 0.05, 0.05, wall=False, **words)
    fine, fine_width, _ = hertz(2, 0.0125, 0.05, wall=False)
    # Hertz's bodies are half-spaces: of these the width is 0.97, however fine they are.
    assert width == pytest.approx(fine_width, abs=0.01)
    assert refined == pytest.approx(fine, rel=0.005)


@pytest.mark.validation
def test_refined_balls_are_pressed_as_hertz_says() -> None:
    where = "X*X + Y*Y + Z*Z < 0.09"
    _, width, load = hertz(3, 0.14, 0.1, wall=False, **finer(where, 0.035, 0.5))
    # As of a ball on a wall, above: flat over a quarter of the radius.
    assert width == pytest.approx(1.0, abs=0.08)
    assert load == pytest.approx(1.0, abs=0.08)
