"""The compiled time loop: the same steps as those of the parts themselves, and its own limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import attrs
import numpy as np
import pytest
from numba.core.config import NUMBA_NUM_THREADS

from solidsph import BuildError, DivergedError, Simulation
from solidsph.engines.compiled.fixed import partition
from solidsph.engines.compiled.time_loop.loop import CompiledLoop
from solidsph.interfaces.compilable_terms import PointwiseLoad
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Load, Observation
from solidsph.interfaces.time_loop import StepError
from solidsph.maths.arrays import Array, Indices, Vector
from solidsph.model.particles import State
from solidsph.registry import registry
from solidsph.run.step_by_step import StepByStep, steps_of
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing.examples import example_part
from tests.helpers.scenes import box, with_effect

STEPS = 25

# Relative to the largest value. Positions of size 1 m carry displacements of a hundredth of that:
# rounding of the one is 1e-14 of the other, and each step adds its own.
ROUNDING = 1e-12


def stretched(builder: SceneBuilder) -> SceneBuilder:
    """Set in motion so that every stress and every speed is there."""
    d = len(builder.scene().bodies["block"].shape.get("lengths", [1.0]))
    field = {"x": "0.05*X", "y": "-0.02*X*Y", "z": "0.03*Y*Z"}
    speed = {"x": "3*sin(2*X)", "y": "2*X", "z": "-Y"}
    names = "xyz"[:d]
    return builder.initial(
        displacement={k: field[k] for k in names}, velocity={k: speed[k] for k in names}
    )


def pressed(builder: SceneBuilder) -> SceneBuilder:
    """Set in motion so that what may touch does."""
    return builder.initial(velocity={"x": "3*sin(3*X)"})


Motion = Callable[[SceneBuilder], SceneBuilder]


def loops(
    builder: SceneBuilder, motion: Motion = stretched
) -> tuple[Simulation, CompiledLoop, StepByStep]:
    simulation = motion(builder.engine("compiled")).build()
    loop = simulation.time_loop()
    assert isinstance(loop, CompiledLoop)
    parts = simulation.dynamics, simulation.integrator
    return simulation, loop, StepByStep(*parts)


def assert_same(one: State, other: State, simulation: Simulation) -> None:
    X = simulation.particles.positions
    assert one.step == other.step
    assert one.time == pytest.approx(other.time, rel=1e-14)
    arrays = {
        "displacements": (one.positions - X, other.positions - X),
        "velocities": (one.velocities, other.velocities),
        "accelerations": (one.accelerations, other.accelerations),
        **{name: (one.memory[name], other.memory[name]) for name in other.memory},
    }
    for name, (found, expected) in arrays.items():
        assert np.abs(found - expected).max() <= ROUNDING * np.abs(expected).max(), name
    assert one.applied.keys() == other.applied.keys()
    # An account may be rounding alone, beside the forces and the energy that are there.
    masses = simulation.dynamics.masses[:, None]
    force = np.abs(masses * other.accelerations).max()
    energy = 0.5 * float(np.sum(masses * other.velocities**2))
    for name, expected in other.applied.items():
        allowed = ROUNDING * max(force, np.abs(expected).max())
        assert np.abs(one.applied[name] - expected).max() <= allowed, name
    for name, work in other.work.items():
        assert abs(one.work[name] - work) <= ROUNDING * max(energy, abs(work)), name


def assert_agree(builder: SceneBuilder, motion: Motion = stretched) -> None:
    simulation, loop, by_step = loops(builder, motion)
    state = simulation.start()
    # In two stretches: what goes from one to the other goes through State.
    ours = loop.advance(loop.advance(state, STEPS // 2), STEPS)
    theirs = by_step.advance(state, STEPS)
    assert_same(ours, theirs, simulation)


@pytest.mark.parametrize(
    "integrator",
    [
        pytest.param(name, marks=() if name == "velocity-verlet" else pytest.mark.validation)
        for name in registry.names("integrators")
    ],
)
def test_every_integrator_and_condition_of_a_bar(integrator: str) -> None:
    assert_agree(
        box(1, 24)
        .boundary("clamp", where="left")
        .boundary("prescribed-motion", where="right", displacement={"x": "0.05 + 0.01*sin(900*t)"})
        .boundary("traction", where="right", traction={"x": "1e3*min(t/1e-3, 1)"})
        .effect("body-force", acceleration={"x": "X + 50*t"})
        .effect("mass-damping", rate=200.0)
        .integrator(integrator)
    )


@pytest.mark.validation  # in the plane by `test_every_effect`
def test_hourglass_control_of_a_bar() -> None:
    assert_agree(box(1, 24).boundary("clamp", where="left").effect("hourglass-control"))


@pytest.mark.parametrize("pressure", ["1e3*(1 + 200*t)", "2e3"])
def test_a_pressure_that_follows_the_surface(pressure: str) -> None:
    """Varying and constant, of a face of several particles; by no call."""
    builder = box(2, 12).boundary("clamp", where="left")
    builder = builder.boundary("pressure", where="right", pressure=pressure)
    _, loop, _ = loops(builder)
    assert [one.called for one in loop.loads] == [None]
    assert_agree(builder)


# The others are under validation: each takes some seconds to compile.
QUICK = {(2, "viscoelastic")}

# What replaces the internal forces by its own.
BY_STEP = {"bond-failure"}

CALLED = ("contact", "dynamic-relaxation", "heat", "rigid-wall")


@pytest.mark.parametrize(
    "effect",
    [
        # The bar above has these two.
        pytest.param(
            name, marks=pytest.mark.validation if name in ("body-force", "mass-damping") else ()
        )
        for name in sorted(set(registry.names("effects")) - BY_STEP - {*CALLED})
    ],
)
def test_every_effect(effect: str) -> None:
    assert_agree(with_effect(effect, 2, 7))


HISTORIES = [
    name
    for name in registry.names("materials")
    if issubclass(registry.load("materials", name), HistoryMaterial)
]


@pytest.mark.parametrize(
    ("material", "dimension"),
    [
        pytest.param(name, d, marks=() if (d, name) in QUICK else pytest.mark.validation)
        for name in HISTORIES
        for d in (1, 2, 3)
    ],
)
def test_every_material_that_remembers(material: str, dimension: int) -> None:
    """With what it remembers; metals flow, at ten times the strain of first yield."""
    law = example_part("materials", material)
    builder = box(dimension, 7).material(law).boundary("clamp", where="left")
    simulation, loop, _ = loops(builder)
    state = simulation.start()
    before, after = (one.memory["history of block"] for one in (state, loop.advance(state, STEPS)))
    assert np.abs(after - before).max() > 1e-3
    assert_agree(builder)


def test_ghosts_of_a_material_that_remembers_go_step_by_step() -> None:
    ghosts = {"type": "lattice", "on_boundary": True, "ghosts": 3}
    law = example_part("materials", "j2-plasticity")
    builder = box(1, 12, discretisation=ghosts).material(law).boundary("ghost-extension")
    assert isinstance(builder.engine("compiled").build().time_loop(), StepByStep)


@pytest.mark.parametrize("effect", sorted(BY_STEP))
def test_others_go_step_by_step_with_compiled_forces(effect: str) -> None:
    by_engine = []
    for engine in ("compiled", "matrix"):
        simulation = pressed(with_effect(effect, 2, 7)).engine(engine).build()
        loop = simulation.time_loop()
        assert isinstance(loop, StepByStep)
        by_engine.append(loop.advance(simulation.start(), STEPS))
    assert_same(*by_engine, simulation)


@pytest.mark.parametrize("effect", CALLED)
def test_effects_of_no_known_kind_are_called(effect: str) -> None:
    builder = with_effect(effect, 2, 7)
    simulation, loop, _ = loops(builder, pressed)
    assert simulation.plan.called == [effect]
    assert loop.advance(simulation.start(), STEPS).work[effect] != 0.0
    assert_agree(builder, pressed)


@pytest.mark.validation  # the bar below has ghosts too
@pytest.mark.parametrize("divergence", registry.names("divergences"))
def test_ghosts_of_a_symmetric_body(divergence: str) -> None:
    """Their motion, their forces handed on, and their stress where it acts."""
    ghosts = {
        "type": "lattice",
        "on_boundary": True,
        "ghosts": 3,
        "ghost_faces": ["left", "bottom"],
    }
    assert_agree(
        box(2, 8, discretisation=ghosts)
        .formulation("total-lagrangian", divergence=divergence)
        .boundary("symmetry", axis="x")
        .boundary("symmetry", axis="y")
    )


def test_the_paper_s_bar() -> None:
    """Plain sums, ghosts beyond both ends, a smoothed extension."""
    ghosts = {"type": "lattice", "on_boundary": True, "ghosts": 3}
    assert_agree(
        box(1, 24, discretisation=ghosts)
        .formulation("total-lagrangian", gradient="difference", divergence="plain")
        .boundary("clamp", where="left")
        .boundary("ghost-extension")
    )


@pytest.mark.validation  # half a minute of compiling
@pytest.mark.skipif(NUMBA_NUM_THREADS < 2, reason="there is one thread only")
def test_several_bodies_and_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(partition, "WORTH_A_THREAD", 1)
    builder = box(3, 7).body(
        "other",
        shape={"type": "box", "lengths": [0.4, 0.4, 0.4], "origin": [3.0, 0.0, 0.0]},
        spacing=0.1,
        material={
            "type": "saint-venant-kirchhoff",
            "youngs_modulus": 3e6,
            "poissons_ratio": 0.2,
            "density": 900.0,
        },
    )
    builder = builder.boundary("clamp", where="left").effect("mass-damping", rate=50.0)
    builder = builder.effect("hourglass-control")
    simulation, loop, by_step = loops(builder)
    state = simulation.start()
    assert loop.threads > 1
    ours = loop.advance(state, 4)
    assert_same(ours, by_step.advance(state, 4), simulation)
    again = loop.advance(state, 4)
    assert np.array_equal(ours.positions, again.positions)
    assert ours.work == again.work


def test_tables_may_be_made_in_portions() -> None:
    """What varies in time is known some steps ahead; how many changes nothing."""
    builder = (
        box(1, 24)
        .boundary("prescribed-motion", where="right", displacement={"x": "0.05 + 0.01*sin(900*t)"})
        .effect("body-force", acceleration={"x": "50*t"})
    )
    simulation, loop, _ = loops(builder)
    assert 10 * STEPS < loop.most_steps < 1 << 18
    short = attrs.evolve(loop)
    object.__setattr__(short, "most_steps", 3)
    state = simulation.start()
    one, other = loop.advance(state, STEPS), short.advance(state, STEPS)
    for name in ("positions", "velocities", "accelerations"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert_same(one, other, simulation)


def test_a_run_by_the_loop_ends_where_a_run_by_steps_does() -> None:
    builder = stretched(box(2, 7).boundary("clamp", where="left")).outputs(3)
    ends = [builder.engine(name).build().run().state for name in ("matrix", "compiled")]
    assert ends[0].step == ends[1].step
    assert np.allclose(ends[0].positions, ends[1].positions, rtol=0.0, atol=1e-12)


def test_conditions_that_share_an_account_are_carried_out_step_by_step() -> None:
    """Nobody could tell whose force the account holds at the start of a stretch."""

    simulation = box(2, 7).effect(Custom(Formula)).engine("compiled").build()
    (load,) = simulation.dynamics.loads
    twice = attrs.evolve(simulation.dynamics, loads=[load, load])
    loop = steps_of(twice, simulation.integrator)
    assert isinstance(loop, StepByStep)


@pytest.mark.validation  # of one step in tests/engines/test_engines.py
def test_single_precision_in_the_loop() -> None:
    simulation = stretched(box(2, 7).boundary("clamp", where="left")).engine("matrix").build()
    single = stretched(box(2, 7).boundary("clamp", where="left")).engine("compiled-float32").build()
    loop = single.time_loop()
    assert isinstance(loop, CompiledLoop)
    X = simulation.particles.positions
    ours = loop.advance(single.start(), STEPS).positions - X
    parts = simulation.dynamics, simulation.integrator
    theirs = StepByStep(*parts).advance(simulation.start(), STEPS).positions - X
    # Forces are rounded to some 1e-7 of the largest; displacements have some steps to gather it.
    missed = np.abs(ours - theirs).max() / np.abs(theirs).max()
    assert 1e-12 < missed < 1e-5


def test_it_stops_at_the_step_that_goes_wrong() -> None:
    # A speed at which neighbours pass each other within some steps.
    builder = box(1, 24).initial(velocity={"x": "-40000*(X - 0.5)"})
    simulation = builder.engine("compiled").build()
    state = simulation.start()
    parts = simulation.dynamics, simulation.integrator
    with pytest.raises(StepError) as ours:
        simulation.time_loop().advance(state, 1000)
    with pytest.raises(StepError) as theirs:
        StepByStep(*parts).advance(state, 1000)
    assert ours.value.state.step == theirs.value.state.step < 1000
    with pytest.raises(DivergedError, match="not finite"):
        simulation.run()


@attrs.frozen
class Custom(Effect):
    """An effect of a third party: a condition on all particles, and nothing about any compiler."""

    condition: type[Load]

    def bind(self, model, label: str) -> Load:
        return self.condition(label, model.select("all"))


@attrs.frozen(eq=False)
class Formula(PointwiseLoad):
    """Springs, and a drag that is computed by way of infinity: 1/(1 + 1/0) is 0."""

    label: str
    particles: Indices
    stiffness_rate = 100.0

    @property
    def values(self) -> Array:
        return np.tile([1.0, 0.0], (len(self.particles), 1))

    @staticmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        return (1.0 / (1.0 + 1.0 / values[1]) - values[0] * np.sin(position[0]), -velocity[1])

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@attrs.frozen(eq=False)
class Opaque(Load):
    """A force that is any code."""

    label: str
    particles: Indices
    stiffness_rate = 100.0

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -10.0 * velocities[self.particles]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


def test_a_formula_of_one_s_own_goes_into_the_loop() -> None:
    """And divides as arrays do."""
    assert_agree(box(2, 7).effect(Custom(Formula)))


def test_what_declares_nothing_is_called() -> None:
    assert_agree(box(1, 24).effect(Custom(Opaque)))


@attrs.frozen(eq=False)
class Overflowing(Opaque):
    """A force that is infinite once the run is on its way."""

    on_its_way: list[bool] = attrs.field(factory=list)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.exp(1e3 * len(self.on_its_way) + 0.0 * velocities[self.particles])


@attrs.frozen(eq=False)
class Lost(Overflowing):
    """A force that cannot be formed once the run is on its way."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        if self.on_its_way:
            raise BuildError(["the neighbours are lost"])
        return super().forces(time, positions, velocities)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("kind", "cause"), [(Overflowing, "not finite"), (Lost, "the neighbours are lost")]
)
def test_a_called_load_that_fails_ends_the_stretch(kind: type[Overflowing], cause: str) -> None:
    """Without a warning of NumPy's, and as step by step."""
    simulation = box(1, 24).effect(Custom(kind)).engine("compiled").build()
    state, (load,) = simulation.start(), simulation.dynamics.loads
    assert isinstance(load, kind)
    load.on_its_way.append(True)
    with pytest.raises(StepError, match=cause):
        simulation.time_loop().advance(state, 10)
