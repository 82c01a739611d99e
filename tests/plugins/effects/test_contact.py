"""Contact: exact conservation, smooth beside lattices, asleep without a trace, honest friction."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import BuildError, Record, Scene, SceneError, Simulation
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import checks, conformance, example_part
from solidsph_builtin.effects import _search
from solidsph_builtin.effects._meeting import Meeting
from solidsph_builtin.effects.contact import Contact
from tests.helpers.examples import examples
from tests.helpers.momenta import assert_momenta_stay
from tests.helpers.scenes import SOFT, box, touching
from tests.house.test_docs import blocks

JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 3}
MODULUS = 1e6 * 0.7 / (1.3 * 0.4)  # lambda + 2 mu of SOFT [Pa]


def condition(simulation: Simulation) -> Any:
    (one,) = [load for load in simulation.dynamics.loads if load.label == "contact"]
    return one


def forces(simulation: Simulation, positions: Array) -> Array:
    """On all particles, (n, d) [N]."""
    found, one = np.zeros_like(positions), condition(simulation)
    found[one.particles] = one.forces(0.0, positions, np.zeros_like(positions))
    return found


def apart(simulation: Simulation, gap: float, aside: float = 0.0) -> Array:
    """Positions with the second body moved away by `gap` and aside [m]."""
    x = simulation.particles.positions.copy()
    rows = simulation.particles.bodies["other"]
    x[rows, 0] += gap
    if x.shape[1] > 1:
        x[rows, 1] += aside
    return x


def energies(simulation: Simulation, positions: Array) -> Array:
    """Of all particles, (n,) [J]."""
    state = attrs.evolve(simulation.start(), positions=positions)
    found: Array = condition(simulation).energies(simulation.dynamics.observe(state))
    return found


def energy(simulation: Simulation, positions: Array) -> float:
    return float(energies(simulation, positions).sum())


def flying(d: int = 2, cells: int = 6, **contact: Any) -> SceneBuilder:
    """Two scattered boxes, one thrown at the other one, off centre and spinning."""
    v = {"x": "10 - 0.5*Y" if d > 1 else 10.0, "y": "0.5*X", "z": 0.2}
    return (
        touching(d, cells, aside=0.3, discretisation=JITTERED)
        .effect("contact", **contact)
        .initial(where="block", velocity={k: v[k] for k in "xyz"[:d]})
        .initial(where="other", displacement={"x": 0.7})
        .integrator("velocity-verlet", time_step_factor=0.4)
        .duration(0.15)
        .outputs(20)
    )


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_momenta_stay_and_the_ledger_closes(d: int, friction: float, tmp_path: Path) -> None:
    simulation = flying(d, {1: 10, 2: 6, 3: 4}[d], friction=friction).build()
    simulation.run(record=tmp_path / "run.h5")
    m = simulation.model.masses
    with Record(tmp_path / "run.h5") as record:
        x, v, history = record.positions[:], record.field("velocity")[:], record.history
    assert history["contact touching pairs [-]"].max() > 0.0
    assert_momenta_stay(m, x, v, least=1.0)
    start = history["kinetic energy [J]"][0]
    # The square of the step: at 0.4 of the CFL step as long as the shortest waves are at work,
    # which these coarse boxes have many of.
    assert np.abs(history["energy residual [J]"]).max() <= 3e-3 * start
    lost = -history["work of contact [J]"] - history["contact energy [J]"]
    if friction and d > 1:
        # Friction only takes, and here it takes a part that matters.
        assert lost[-1] > 0.01 * start
        assert np.diff(lost).min() >= -3e-3 * start
    else:
        assert np.abs(lost).max() <= 3e-3 * start


@examples(25)
@given(
    d=st.sampled_from([1, 2, 3]),
    gap=st.floats(-1.5, 0.2),
    aside=st.floats(0.0, 1.0),
    seed=st.integers(0, 1000),
)
def test_forces_derive_from_the_energy_and_are_opposite(
    d: int, gap: float, aside: float, seed: int
) -> None:
    cells = {1: 8, 2: 5, 3: 3}[d]
    s = 1.0 / cells
    simulation = touching(d, cells, discretisation=JITTERED).effect("contact").build()
    random = np.random.default_rng(seed)
    x = apart(simulation, gap * s, aside * s)
    x += 0.05 * s * random.standard_normal(x.shape)
    f = forces(simulation, x)
    size = np.abs(f).sum()
    if size == 0.0:
        return
    assert np.abs(f.sum(axis=0)).max() <= 1e-13 * size
    turn = x.T @ f
    assert np.abs(turn - turn.T).max() <= 1e-13 * np.abs(x).max() * size
    step = 1e-4 * s * random.standard_normal(x.shape)
    ahead, behind = energies(simulation, x + step), energies(simulation, x - step)
    # A particle that touches at one end alone has a kink in between, and no more than its energy.
    kinks = ahead[behind == 0.0].sum() + behind[ahead == 0.0].sum()
    # A central difference leaves the square of the step, 1e-8, of the excess and of its change; so
    # of an excess that is itself as small as its change, 1e-4 or so, it leaves more: by steps of
    # three deviations 3e-8 of K V times that change.
    curved = 3e-10 * MODULUS * s**d
    assert ahead.sum() - behind.sum() == pytest.approx(
        -2.0 * float(np.vdot(f, step)), abs=1e-5 * np.abs(f * step).sum() + kinks + curved
    )


@pytest.mark.parametrize("on_boundary", [False, True])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_bodies_touch_where_their_surfaces_are(d: int, on_boundary: bool) -> None:
    """Particles at the centres of cells at one spacing, those on the surface where they meet."""
    cells = {1: 10, 2: 8, 3: 6}[d]
    lattice = {"type": "lattice", "on_boundary": on_boundary}
    simulation = touching(d, cells, discretisation=lattice).effect("contact").build()
    s = 1.0 / cells
    first = simulation.particles.bodies["block"]

    def pressure(gap: float) -> float:
        return -float(forces(simulation, apart(simulation, gap * s))[first, 0].sum())

    # Deep layers have no room at all where a lattice fills 1.0003.
    assert abs(pressure(0.1)) <= 1e-6 * MODULUS
    # Beside a lattice S is a constant to 7e-4, and where it ends is known to some 1e-2 spacings.
    assert pressure(0.0) <= 0.02 * MODULUS
    assert pressure(-0.1) > 2.0 * pressure(0.0)
    # One spacing of material yields 0.1 under a tenth of its modulus; with particles on the
    # surface, which weigh a half, two or three.
    assert 0.03 < pressure(-0.1) / MODULUS < 0.2


@pytest.mark.parametrize("d", [2, 3])
def test_fitted_particles_touch_where_their_surfaces_are(d: int) -> None:
    """Fits give particles on a surface 3/8 of a cell, and more to the row below."""
    scene = (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [1.0] * d}, spacing=0.2)
        .body(
            "other",
            shape={"type": "box", "lengths": [1.0] * d, "origin": [1.0] + [0.0] * (d - 1)},
            spacing=0.2,
        )
        .material("neo-hookean", **SOFT)
        .effect("contact")
        .duration(1e-2)
    )
    simulation = scene.build()
    assert simulation.model.bodies[0].particles.volumes.min() < 0.4 * 0.2**d
    pushed = [
        abs(
            forces(simulation, apart(simulation, -depth))[
                : simulation.model.bodies[0].extent.stop, 0
            ].sum()
        )
        for depth in (1e-4, 2e-4)
    ]
    # Two thousandths of a spacing and half of that: at once, and in proportion.
    assert pushed[0] > 1e-4 / 0.2 * SOFT["youngs_modulus"] * 0.3
    assert pushed[1] == pytest.approx(2.0 * pushed[0], rel=0.1)


def test_lattices_do_not_interlock() -> None:
    """A block pressed on a plate and moved along it goes up no hill: the pair force of one spacing
    has hills of 0.13 spacings, at the same lattices."""
    s = 0.1
    simulation = (
        box(2, 10)
        .body(
            "other",
            shape={"type": "box", "lengths": [2.2, 0.5], "origin": [-0.6, 1.0]},
            spacing=s,
        )
        .effect("contact")
        .build()
    )
    rows = simulation.particles.bodies["other"]

    def stored(down: float, along: float) -> float:
        x = simulation.particles.positions.copy()
        x[rows] += [along * s, -down * s]
        return energy(simulation, x)

    along = np.array([stored(0.1, k / 8.0) for k in range(9)])
    # What the far ends weigh more fades from particle to particle, but does not end.
    assert along[0] == pytest.approx(along[-1], rel=1e-5)
    hill = float(np.ptp(along)) / ((stored(0.11, 0.0) - stored(0.09, 0.0)) / 0.02)  # [spacings]
    assert hill < 2e-3


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_sleep_changes_nothing(friction: float) -> None:
    results = [
        flying(friction=friction, margin=margin).build().run().state
        for margin in (0.0, 1.0, float("inf"))
    ]
    asleep = [float(state.memory["contact evaluations asleep"][0]) for state in results]
    assert asleep[0] > asleep[1] > asleep[2] == 0.0
    for other in results[1:]:
        assert np.array_equal(results[0].positions, other.positions)
        assert results[0].work == other.work


def test_the_list_of_neighbours_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = flying().build().run().state
    monkeypatch.setattr(_search, "_SKIN", 0.0)  # anew at every step
    found = flying().build().run().state
    assert np.array_equal(expected.positions, found.positions)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_restart_goes_on_to_the_bit(friction: float) -> None:
    simulation = flying(friction=friction).build()
    whole = simulation.run().state
    middle = simulation.time_loop().advance(simulation.start(), simulation.steps // 2)
    # Anew, with empty caches.
    again = flying(friction=friction).build()
    ended = again.time_loop().advance(middle, again.steps)
    assert np.array_equal(whole.positions, ended.positions)
    assert all(np.array_equal(whole.memory[name], ended.memory[name]) for name in whole.memory)


def test_a_body_that_folds_touches_itself() -> None:
    """Two arms of a U, closed by their motion: apart in the reference configuration."""
    arms = {
        "type": "difference",
        "of": {"type": "box", "lengths": [1.0, 0.55]},
        "minus": {"type": "box", "lengths": [0.8, 0.15], "origin": [0.3, 0.2]},
    }

    def closed(itself: list[str]) -> tuple[float, float]:
        builder = (
            Simulation.builder()
            .scheme("corrected")  # rows half a spacing deep, which touch at one spacing
            .body("fork", shape=arms, spacing=0.025)
            .kernel("cubic-spline", cover=2.2)
            .material("neo-hookean", **SOFT)
            .formulation("total-lagrangian")
            .effect("hourglass-control")
            .initial(where="X > 0.3 and Y > 0.275", velocity={"y": "-10*(X-0.3)"})
            .initial(where="X > 0.3 and Y < 0.275", velocity={"y": "10*(X-0.3)"})
            .engine("matrix")
            .duration(0.03)
            .outputs(15)
        )
        if itself:
            builder.effect("contact", itself=itself)
        simulation = builder.build()
        X = simulation.particles.positions
        slot = np.abs(X[:, 1] - 0.275) < 0.1
        tips = [(X[:, 0] > 0.9) & slot & side for side in (X[:, 1] < 0.275, X[:, 1] > 0.275)]
        smallest, pairs = np.inf, 0.0
        state, loop = simulation.start(), simulation.time_loop()
        for stop in simulation.output_steps():
            state = loop.advance(state, stop)
            x = state.positions[:, 1]
            smallest = min(smallest, float(x[tips[1]].mean() - x[tips[0]].mean()))
            if itself:
                observation = simulation.dynamics.observe(state)
                report = condition(simulation).report(observation)
                pairs = max(pairs, report["contact touching pairs [-]"])
        return smallest, pairs

    free, _ = closed([])
    held, pairs = closed(["fork"])
    # Their outermost rows touch at one spacing, and yield by the strain of the impact, v / c.
    assert free < -0.05
    assert held > 0.025 * (1.0 - 1.5 * 7.0 / 36.7)
    assert pairs > 0.0


def test_coulombs_law_between_two_bodies() -> None:
    """A block pressed on another one and pulled along it: the force of friction is f N."""
    f = 0.4
    simulation = (
        touching(2, 8)
        .effect("contact", friction=f)
        .initial(where="other", displacement={"x": -0.02}, velocity={"y": 2.0})
        .build()
    )
    state = simulation.start()
    one, m = condition(simulation), simulation.particles.bodies["other"]
    x, v = state.positions.copy(), state.velocities
    memory: dict[str, Array] = dict(state.memory)
    force = np.zeros_like(x)
    for _ in range(300):  # led by hand, so that nothing deforms
        x = x + 1e-4 * v
        force[one.particles], memory = one.advance(0.0, 1e-4, x, v, memory)
    normal, along = force[m].sum(axis=0)
    # Normals beside edges are not quite those of the face.
    assert -along / normal == pytest.approx(f, rel=0.02)
    turn = x.T @ force
    assert np.abs(turn - turn.T).max() <= 1e-13 * np.abs(force).sum()


def rubbing(friction: float, bodies: int) -> Simulation:
    """Blocks in a row that are pressed together, each moving along the faces of the next."""
    builder = touching(2, 5)
    if bodies == 3:
        third = {"type": "box", "lengths": [1.0, 1.0], "origin": [2.0, 0.3]}
        builder.body("third", shape=third, spacing=0.125)
        builder.initial(where="third", displacement={"x": -0.03}, velocity={"y": 3.0})
    return (
        builder.effect("contact", friction=friction)
        .initial(where="other", displacement={"x": -0.02}, velocity={"y": 2.0})
        .build()
    )


def told_on(told: Mapping[str, float], name: str, axis: str) -> float:
    """Sum of the forces on a body by what the columns say, with those that it exerts [N]."""
    total = 0.0
    for column, value in told.items():
        if column.endswith(f" on {name} {axis} [N]"):
            total += value
        elif column.startswith(f"contact force of {name} on ") and column.endswith(f"{axis} [N]"):
            total -= value
    return total


@pytest.mark.parametrize("bodies", [2, 3])
@pytest.mark.parametrize("friction", [0.0, 0.3, 2.0])
def test_the_force_told_is_what_changes_the_momentum(friction: float, bodies: int) -> None:
    """Nothing else acts on a body as a whole: the forces on it that are told, with friction, are
    mass times acceleration of all its particles."""
    simulation = rubbing(friction, bodies)
    state, loop, m = simulation.start(), simulation.time_loop(), simulation.model.masses
    one, rubbed = condition(simulation), 0.0
    for step in (0, 1, 5, 20):
        state = loop.advance(state, step) if step else state
        told = one.report(simulation.dynamics.observe(state))
        for name, rows in simulation.particles.bodies.items():
            change = m[rows] @ state.accelerations[rows]
            for k, axis in enumerate("xy"):
                on = told_on(told, name, axis)
                # Inner forces are summed up as well, and are larger by far: rounding of those.
                assert on == pytest.approx(change[k], abs=1e-9 * MODULUS)
        rubbed = max(rubbed, abs(told["contact force of block on other y [N]"]))
    # Without friction the faces push along x, but where they bend.
    assert (rubbed > 1e3) == (friction > 0.0)


def test_a_named_pair_alone() -> None:
    builder = touching(2).body(
        "third", shape={"type": "box", "lengths": [1.0, 1.0], "origin": [2.0, 0.0]}, spacing=1 / 6
    )
    simulation = builder.effect("contact", between=[["other", "third"]]).build()
    assert [one.name for one in condition(simulation).meetings] == ["other and third"]
    everyone = builder.effect("contact", label="all").build()
    (load,) = [one for one in everyone.dynamics.loads if one.label == "all"]
    assert len(load.meetings) == 3


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({}, "nothing that it could touch"),
        ({"itself": ["ring"]}, "no body 'ring'"),
        ({"itself": "block"}, "list of names"),
        ({"between": [["block"]]}, "list of pairs"),
        ({"between": "block"}, "list of pairs"),
        ({"between": [["block", "plate"]]}, "no body 'plate'"),
        ({"friction": -0.1}, "between 0 and 100"),
        ({"margin": -1.0}, "not be negative"),
        ({"strength": 0.0}, "positive"),
    ],
)
def test_what_cannot_be_is_refused_with_its_remedy(parameters: Any, words: str) -> None:
    with pytest.raises((BuildError, SceneError), match=words):
        box(2).effect("contact", **parameters).build()


class OneSided(Meeting):
    """The second body feels nothing of the first."""

    def normal_forces(self, touch: Any) -> Array:
        return np.where(self.belongs[:, None], super().normal_forces(touch), 0.0)


class Sideways(Meeting):
    """Opposite, but not along the line between two particles."""

    def pushes(self, touch: Any) -> Array:
        pushes = super().pushes(touch)
        return np.roll(pushes, 1, axis=1) if pushes.shape[1] > 1 else pushes


@pytest.mark.parametrize("wrong", [OneSided, Sideways])
def test_the_kit_finds_a_wrong_contact(
    wrong: type[Meeting], monkeypatch: pytest.MonkeyPatch
) -> None:
    from solidsph_builtin.effects import _meeting_of_bodies

    monkeypatch.setattr(_meeting_of_bodies, "Meeting", wrong)
    (momentum,) = [one for one in checks("effects") if one.__name__ == "momentum"]
    assert not momentum(Contact()).passed


@pytest.mark.parametrize("name", ["contact", "rigid-wall"])
def test_both_are_certified(name: str) -> None:
    results = conformance("effects", example_part("effects", name))
    assert [one for one in results if not one.passed] == []


def test_the_declared_frequency_holds_however_they_meet() -> None:
    """Also deep, and at a lattice's worst; the kit looks at bodies at rest."""
    for d, cells in ((1, 8), (2, 5)):
        simulation = touching(d, cells, discretisation=JITTERED).effect("contact").build()
        (load,) = simulation.dynamics.loads
        s, m = 1.0 / cells, simulation.model.masses
        for gap in (-0.1, -0.5, -0.8):
            x = apart(simulation, gap * s, 0.3 * s)
            step, columns = 1e-5 * s, []
            for k in range(x.size):
                u = np.zeros(x.size)
                u[k] = step
                u = u.reshape(x.shape)
                change = forces(simulation, x - u) - forces(simulation, x + u)
                columns.append((change / (2.0 * step * m[:, None])).ravel())
            largest = np.linalg.eigvals(np.column_stack(columns)).real.max()
            assert np.sqrt(largest) <= load.stiffness_rate


def test_the_scenes_of_the_page_run() -> None:
    shown = [text for text in blocks("docs/effects.md", "toml") if _OWN.search(text)]
    assert len(shown) >= 2
    for text in shown:
        simulation = Simulation.builder(Scene.from_toml(text)).build()
        state = simulation.time_loop().advance(simulation.start(), 20)
        assert np.isfinite(state.positions).all()


_OWN = re.compile('type = "(contact|rigid-wall)"')
