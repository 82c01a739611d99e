"""Contact of bodies whose spacing varies: exact conservation, faces that touch where they are."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import Record, Simulation
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.effects._crowding import REACH, crowding_kernel
from solidsph_builtin.effects._sites import FilledBeside, filled_beside, first_row
from tests.helpers.examples import examples
from tests.helpers.momenta import assert_momenta_stay
from tests.helpers.scenes import SOFT
from tests.plugins.effects.test_contact import MODULUS, condition, energies, forces

GAP = 0.5  # between the bodies at the start [m]
DEPTH = 0.6  # of the first body along x [m]

Words = dict[str, Any]


def refined(where: str, coarse: float, ratio: float, over: float = 0.5) -> Words:
    """A spacing that is `ratio` times finer at a place."""
    finer = {"where": where, "spacing": coarse / ratio, "over": over}
    return {"spacing": coarse, "refine": [finer]}


def pair(d: int, block: Words, other: Words, **contact: Any) -> SceneBuilder:
    """Two boxes apart along x."""
    builder = Simulation.builder().material("neo-hookean", **SOFT).engine("matrix").duration(0.05)
    for name, words, start in (("block", block, 0.0), ("other", other, DEPTH + GAP)):
        origin = [start, *[0.0] * (d - 1)]
        shape: Words = {"type": "box", "lengths": [DEPTH, *[1.0] * (d - 1)], "origin": origin}
        if d == 1:
            shape = {"type": "interval", "length": DEPTH, "origin": start}
        builder = builder.body(name, shape=shape, **words)
    return builder.effect("contact", **contact)


def closed(simulation: Simulation, way: float, aside: float = 0.0) -> Array:
    """Positions with the second body pushed into the first by a `way`, and aside [m]."""
    x = simulation.particles.positions.copy()
    rows = simulation.particles.bodies["other"]
    x[rows, 0] -= GAP + way
    x[rows, 1:2] += aside
    return x


def pressure(simulation: Simulation, way: float, aside: float = 0.0) -> float:
    """Mean pressure on the face of the first body, over the modulus [-]."""
    rows = simulation.particles.bodies["block"]
    return -float(forces(simulation, closed(simulation, way, aside))[rows, 0].sum()) / MODULUS


@cache
def scattered(d: int, friction: float = 0.0) -> Simulation:
    """One body is fine where the other one is coarse."""
    coarse = {1: 0.06, 2: 0.2, 3: 0.3}[d]
    lower, upper = ("Y < 0.2", "Y > 0.8") if d > 1 else ("right", "left")
    other = refined(upper, 0.8 * coarse, 2.0, 0.6)
    return pair(d, refined(lower, coarse, 3.0, 0.8), other, friction=friction).build()


@examples(25)
@given(
    d=st.sampled_from([1, 2, 3]),
    way=st.floats(-0.2, 1.5),
    aside=st.floats(-0.5, 0.5),
    seed=st.integers(0, 1000),
)
def test_forces_derive_from_the_energy_and_are_opposite(
    d: int, way: float, aside: float, seed: int
) -> None:
    simulation, random = scattered(d), np.random.default_rng(seed)
    s = simulation.particles.spacings
    x = closed(simulation, way * s.min(), aside)
    x += 0.05 * s[:, None] * random.standard_normal(x.shape)
    f = forces(simulation, x)
    size = np.abs(f).sum()
    if size == 0.0:
        return
    # Rounding of sums.
    assert np.abs(f.sum(axis=0)).max() <= 1e-13 * size
    turn = x.T @ f
    assert np.abs(turn - turn.T).max() <= 1e-13 * np.abs(x).max() * size
    step = 1e-5 * s.min() * random.standard_normal(x.shape)
    gained = energies(simulation, x + step).sum() - energies(simulation, x - step).sum()
    # Central differences leave the square of the step; energies are rounded to 1e-16 of the whole.
    rounding = 1e-14 * energies(simulation, x).sum()
    work = -2.0 * float(np.sum(f * step))
    assert abs(gained - work) <= 1e-6 * float(np.abs(2.0 * f * step).sum()) + rounding


@examples(15)
@given(d=st.sampled_from([1, 2, 3]), way=st.floats(0.1, 1.5), seed=st.integers(0, 1000))
def test_the_tangent_is_the_derivative_of_the_forces(d: int, way: float, seed: int) -> None:
    simulation, random = scattered(d), np.random.default_rng(seed)
    X, s = simulation.particles.positions, simulation.particles.spacings
    x = closed(simulation, way * s.min()) + 0.05 * s[:, None] * random.standard_normal(X.shape)
    du = random.standard_normal(X.shape)
    step = 1e-7
    change = forces(simulation, x - step * du) - forces(simulation, x + step * du)
    K = condition(simulation).stiffness(x - X, 0.0)
    if K is None:
        assert not change.any()
        return
    wrong = (K @ du.ravel()).reshape(du.shape) - change / (2.0 * step)
    # A particle may begin to touch within the difference.
    assert np.linalg.norm(wrong) <= 1e-5 * np.linalg.norm(change / (2.0 * step))


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_momenta_stay_and_the_ledger_closes(friction: float, tmp_path: Path) -> None:
    simulation = (
        pair(2, refined("Y < 0.4", 0.2, 3.0), refined("left", 0.2, 2.0), friction=friction)
        .initial(where="block", velocity={"x": "10 - 0.5*Y", "y": "0.5*X + 3"})
        .initial(where="other", displacement={"x": -0.97 * GAP})
        .integrator("velocity-verlet", time_step_factor=0.4)
        .outputs(10)
        .build()
    )
    simulation.run(record=tmp_path / "run.h5")
    m = simulation.model.masses
    with Record(tmp_path / "run.h5") as record:
        x, v, history = record.positions[:], record.field("velocity")[:], record.history
    assert history["contact touching pairs [-]"].max() > 0.0
    assert_momenta_stay(m, x, v)
    start = history["kinetic energy [J]"][0]
    # The square of the step: at 0.4 of the CFL step, as long as the shortest waves are at work.
    assert np.abs(history["energy residual [J]"]).max() <= 3e-3 * start
    lost = -history["work of contact [J]"] - history["contact energy [J]"]
    if friction:
        assert lost[-1] > 0.005 * start
    else:
        assert np.abs(lost).max() <= 3e-3 * start


@pytest.mark.parametrize(
    ("where", "ratio"),
    [
        ("face", 2.0),
        ("face", 8.0),
        ("faces", 2.0),
        ("faces", 4.0),
        ("corner", 4.0),
        ("corners", 2.0),
        ("corners", 4.0),
        ("opposite", 4.0),
        pytest.param("faces", 8.0, marks=pytest.mark.validation),
        pytest.param("corners", 8.0, marks=pytest.mark.validation),
        pytest.param("opposite", 8.0, marks=pytest.mark.validation),
    ],
)
def test_faces_touch_where_their_surfaces_are(where: str, ratio: float) -> None:
    """Within some hundredths of the spacing there, 0.06 where it grows steeply from the face on."""
    check_touching(2, where, 0.1, ratio)


@pytest.mark.validation
@pytest.mark.parametrize("where", ["face", "faces", "corners"])
@pytest.mark.parametrize("ratio", [2.0, 4.0])
def test_faces_touch_where_their_surfaces_are_in_space(where: str, ratio: float) -> None:
    check_touching(3, where, 0.2, ratio)


def check_touching(d: int, where: str, coarse: float, ratio: float) -> None:
    fine = coarse / ratio
    over = 5.0 * (coarse - fine)
    low = refined("Y < 0.1", coarse, ratio, over)
    right, left = (refined(face, coarse, ratio, over) for face in ("right", "left"))
    block, other, spacing = {
        "face": (right, {"spacing": coarse}, coarse),
        "faces": (right, left, fine),
        "corner": (low, {"spacing": coarse}, coarse),
        "corners": (low, low, coarse),
        "opposite": (low, refined("Y > 0.9", coarse, ratio, over), coarse),
    }[where]
    simulation = pair(d, block, other).build()
    # A face yields by about a spacing: a pressure of 0.05 is a twentieth of one.
    assert pressure(simulation, -0.2 * spacing) == 0.0
    assert pressure(simulation, 0.0) < 0.05
    assert pressure(simulation, 0.2 * spacing) > 0.02


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("ratio", [1.0, 1.6, 4.0, 8.0])
def test_the_table_of_ratios_is_that_of_one_spacing(d: int, ratio: float) -> None:
    """Of a fine lattice beside a coarser one, where both are known."""
    shape = {"type": "box", "lengths": [1.0] * d} if d > 1 else {"type": "interval", "length": 1.0}
    (body,) = (
        Simulation.builder()
        .body("block", shape=shape, spacing=0.1, discretisation="lattice")
        .material("neo-hookean", **SOFT)
        .duration(1.0)
        .build()
        .model.bodies
    )
    H = REACH * ratio * 0.1
    heights = np.linspace(0.0, H, 50)
    # Rows of one lattice alone, as deep as the reach; the last of the body is 0.95 below.
    beside = filled_beside(body, crowding_kernel(d, H), heights)
    rows = np.full(50, first_row(body)[0])
    found = FilledBeside.of(body).at(heights, np.full(50, 0.1), rows, np.full(50, H))
    # Linear interpolation between ratios that are 0.02 apart.
    assert np.abs(found - beside).max() < 3e-5


def test_a_body_touches_itself_where_it_is_fine() -> None:
    """The arms of a fork, nearer to each other than five of its coarse spacings."""
    shape = {
        "type": "difference",
        "of": {"type": "box", "lengths": [1.0, 0.55]},
        "minus": {"type": "box", "lengths": [0.8, 0.15], "origin": [0.3, 0.2]},
    }
    fine = 0.0125
    simulation = (
        Simulation.builder()
        .body("fork", shape=shape, **refined("X > 0.7", 0.05, 4.0, 0.2))
        .material("neo-hookean", **SOFT)
        .effect("contact", itself=["fork"])
        .engine("matrix")
        .duration(1.0)
        .build()
    )
    X = simulation.particles.positions
    upper = (X[:, 0] > 0.3) & (X[:, 1] > 0.275)

    def held(way: float) -> float:
        x = X.copy()
        x[upper, 1] -= 0.15 + way
        f = forces(simulation, x)
        assert np.abs(f.sum(axis=0)).max() <= 1e-13 * np.abs(f).sum()
        tips = upper & (X[:, 0] > 0.75)
        return float(f[tips, 1].sum()) / MODULUS / 0.25

    assert held(-0.2 * fine) == 0.0
    assert held(0.0) < 0.03
    assert held(0.2 * fine) > 0.05


def test_bodies_that_lie_on_each_other_do_not_press() -> None:
    simulation = pair(2, refined("Y < 0.1", 0.1, 4.0), refined("left", 0.1, 2.0)).scene()
    shape = {"type": "box", "lengths": [0.6, 1.0], "origin": [DEPTH, 0.0]}
    other = attrs.evolve(simulation.bodies["other"], shape=shape)
    bodies = {**simulation.bodies, "other": other}
    built = Simulation.builder(attrs.evolve(simulation, bodies=bodies)).build()
    X = built.particles.positions
    assert not forces(built, X).any()
    x = X.copy()
    x[built.particles.bodies["other"], 0] -= 0.01
    assert forces(built, x).any()


def test_the_declared_frequency_holds_however_they_meet() -> None:
    simulation, random = scattered(2), np.random.default_rng(3)
    X, s = simulation.particles.positions, simulation.particles.spacings
    load, m = condition(simulation), np.repeat(simulation.model.masses, 2)
    for way in (0.1, 0.3, 0.5, 0.8):
        for aside in (0.0, 0.4, -0.4):
            x = closed(simulation, way * s.min(), aside)
            x += 0.02 * s[:, None] * random.standard_normal(x.shape)
            K = load.stiffness(x - X, 0.0)
            largest = np.linalg.eigvals(K.toarray() / m[:, None]).real.max()
            assert 0.0 < np.sqrt(largest) <= load.stiffness_rate


def test_sleep_and_the_list_of_neighbours_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from solidsph_builtin.effects import _search

    def end(margin: float) -> Array:
        simulation = (
            pair(2, refined("Y < 0.4", 0.2, 3.0), refined("left", 0.2, 2.0), margin=margin)
            .initial(where="block", velocity={"x": 10.0, "y": 2.0})
            .initial(where="other", displacement={"x": -0.9 * GAP})
            .duration(0.02)
            .build()
        )
        return simulation.run().state.positions

    asleep, awake = end(0.0), end(np.inf)
    assert np.array_equal(asleep, awake)
    monkeypatch.setattr(_search, "_SKIN", 0.0)
    assert np.array_equal(end(1.0), asleep)
