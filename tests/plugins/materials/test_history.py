"""Materials that remember: their history in the engines, in State, in the ledger and in records."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np
import pytest

from solidsph import Record, Simulation, resume
from solidsph.engines.array_law import ArrayLaw
from solidsph.engines.law_forces import LawForces
from solidsph.errors import BuildError
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import memory_name
from solidsph.registry import registry
from solidsph.results import checkpointer
from solidsph.run.energy import DISSIPATED, KINETIC, RESIDUAL, STRAIN
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import conformance, example_part
from tests.helpers.resuming import OFTEN, Stop

REMEMBERING = [
    name
    for name in registry.names("materials")
    if issubclass(registry.load("materials", name), HistoryMaterial)
]
every_history = pytest.mark.parametrize("name", REMEMBERING)

RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
PRONY = [{"share": 0.3, "time": 2e-3}, {"share": 0.2, "time": 0.05}]
VISCOELASTIC = {"type": "viscoelastic", **RUBBER, "prony": PRONY}


def block(d: int, material: object, speed: str = "5*X*(1 + 0.3*sin(9*X))") -> SceneBuilder:
    shape = (
        {"type": "interval", "length": 1.0}
        if d == 1
        else {"type": "box", "lengths": [1.0, 0.6, 0.5][:d]}
    )
    return (
        Simulation.builder()
        .body("block", shape=shape, spacing=0.1)
        .kernel("cubic-spline", cover=2.6)
        .material(material)
        .boundary("clamp", where="left")
        .initial(velocity={"x": speed})
        .duration(0.02)
        .outputs(10)
    )


def bar(material: object, **motion: str) -> SceneBuilder:
    """A bar of 50 particles whose ends and particles move as told."""
    return (
        Simulation.builder()
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.02)
        .kernel("cubic-spline", cover=2.6)
        .material(material)
        .boundary("prescribed-motion", where="all", displacement=motion)
    )


# A law takes seconds to compile, in every dimension anew: here in one, in all by `make validate`.
mostly_in_2d = pytest.mark.parametrize(
    "d", [pytest.param(d, marks=() if d == 2 else pytest.mark.validation) for d in (1, 2, 3)]
)


@every_history
@mostly_in_2d
def test_every_engine_remembers_the_same(name: str, d: int) -> None:
    """Both engines advance the histories alike, and what they lead to."""
    runs = [
        block(d, example_part("materials", name)).engine(engine).build().run().state
        for engine in ("matrix", "compiled")
    ]
    one, other = runs
    motion = np.abs(one.positions - block(d, VISCOELASTIC).build().particles.positions).max()
    # Rounding, which some hundred steps of a smooth motion carry on without much growth.
    assert np.abs(one.positions - other.positions).max() < 1e-11 * motion
    assert set(one.memory) == set(other.memory)
    history = memory_name(block(d, VISCOELASTIC).build().model.bodies[0])
    scale = np.maximum(np.abs(one.memory[history]).max(axis=0), 1e-12)
    assert np.abs((one.memory[history] - other.memory[history]) / scale).max() < 1e-9


@every_history
@mostly_in_2d
def test_the_compiled_law_is_that_of_arrays(name: str, d: int) -> None:
    """Where a law compiles, its loop over points is the array formula to rounding."""
    simulation = block(d, example_part("materials", name)).engine("compiled").build()
    internal = simulation.dynamics.internal
    assert isinstance(internal, LawForces)
    (law,) = internal.laws
    array = ArrayLaw(law.body)
    rng = np.random.default_rng(d)
    history = array.history_of({})
    scale = law.body.material.lame_parameters[1]
    for _ in range(5):
        H = 0.1 * rng.normal(size=(law.body.particles.count, d, d))
        (P, h), (Q, k) = law.flux(H, history, 1e-4), array.flux(H, history, 1e-4)
        assert np.abs(P - Q).max() < 1e-12 * scale
        assert np.allclose(h, k, rtol=1e-12, atol=1e-12)
        history = k


def test_a_steady_strain_rate_follows_the_prony_series() -> None:
    """e = r t: sigma = K e + 4/3 (mu_inf e + sum of mu_i tau_i r (1 - exp(-t / tau_i)))."""
    e, T = 1e-6, 0.02
    simulation = bar(VISCOELASTIC, x=f"{e}*X*t/{T}").duration(T).outputs(20).build()
    state, loop, found, times = simulation.start(), simulation.time_loop(), [], []
    for stop in simulation.output_steps():
        state = loop.advance(state, stop)
        found.append(float(simulation.dynamics.observe(state).stresses[25, 0, 0]))
        times.append(state.time)
    part = example_part("materials", "viscoelastic", **RUBBER, prony=PRONY)
    lam, mu = part.lame_parameters
    t, r = np.array(times), e / T
    left = mu * (1.0 - sum(one["share"] for one in PRONY))
    overstress = sum(
        mu * one["share"] * one["time"] * r * (1.0 - np.exp(-t / one["time"])) for one in PRONY
    )
    expected = (lam + 2.0 / 3.0 * mu) * r * t + 4.0 / 3.0 * (left * r * t + overstress)
    # The law is not linear: a strain of 1e-6 shows by some 1e-6.
    assert np.allclose(found, expected, rtol=1e-5)
    elastic = (lam + 2.0 * mu) * r * t
    assert abs(found[-1] / elastic[-1] - 1.0) > 0.05  # or else nothing has relaxed


def test_a_wave_decays_by_the_complex_modulus() -> None:
    """A standing wave: rho s^2 + k^2 M(s) = 0 gives both its frequency and its decay."""
    tau, share = 2e-3, 0.3
    material = {"type": "viscoelastic", **RUBBER, "prony": [{"share": share, "time": tau}]}
    part = example_part("materials", "viscoelastic", **RUBBER, prony=material["prony"])
    lam, mu = part.lame_parameters
    k = np.pi
    rho, M, M_1 = 1000.0, lam + 2.0 * mu, 4.0 / 3.0 * share * mu
    # rho s^2 (1 + s tau) + k^2 ((M - M_1) (1 + s tau) + M_1 s tau) = 0
    roots = np.roots([rho * tau, rho, k**2 * M * tau, k**2 * (M - M_1)])
    s = roots[np.argmax(roots.imag)]
    simulation = (
        Simulation.builder()
        .body(
            "bar",
            shape={"type": "interval", "length": 1.0},
            spacing=0.0125,
            discretisation="fitted",
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="consistent")
        .material(material)
        .boundary("clamp", where="left")
        .boundary("clamp", where="right")
        .initial(velocity={"x": "1e-4*sin(pi*X)"})
        .duration(4.0 * 2.0 * np.pi / s.imag)
        .outputs(200)
        .build()
    )
    X = simulation.particles.positions[:, 0]
    state, loop, amplitudes, times = simulation.start(), simulation.time_loop(), [], []
    for stop in simulation.output_steps():
        state = loop.advance(state, stop)
        amplitudes.append(float((state.positions[:, 0] - X) @ np.sin(np.pi * X)) * 2.0 * 0.0125)
        times.append(state.time)
    # The closed form, all three roots: u(0) = 0, v(0) = 1e-4, and no viscous strain at the start.
    t = np.array(times)
    C = np.linalg.solve(
        [np.ones(3), roots, roots**2], np.array([0.0, 1e-4, 0.0], dtype=np.complex128)
    )
    expected = (np.exp(np.outer(t, roots)) @ C).real
    largest = np.abs(expected).max()
    # The ends and the spacing, a phase that grows over four periods: measured 2.7e-3.
    assert np.abs(amplitudes - expected).max() < 5e-3 * largest
    # A negative control: without the element's decay it is far off.
    undamped = 1e-4 / abs(s.imag) * np.sin(s.imag * t)
    assert np.abs(amplitudes - undamped).max() > 0.1 * largest


@every_history
def test_the_ledger_closes_with_what_is_dissipated(name: str, tmp_path: Path) -> None:
    # At half the default step, whose own error is 0.12 %, with an elastic material as well.
    builder = block(2, example_part("materials", name), speed="20*X").outputs(40)
    builder.integrator("central-difference", time_step_factor=0.25).build().run(
        record=tmp_path / "record.h5"
    )
    with Record(tmp_path / "record.h5") as record:
        history = record.history
        play = np.abs(history[KINETIC] + history[STRAIN]).max()
        assert history[DISSIPATED][-1] > 1e-3 * play  # or else nothing is tested
        assert np.all(np.diff(history[DISSIPATED]) >= -1e-12 * play)
        assert np.abs(history[RESIDUAL]).max() < 1e-3 * play


@every_history
def test_histories_survive_a_restart_bit_for_bit(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)
    scene = block(2, example_part("materials", name)).outputs(8)
    whole = scene.build().run(record=tmp_path / "whole.h5").state
    with pytest.raises(KeyboardInterrupt):
        scene.build().run(record=tmp_path / "half.h5", observers=[Stop(5)])
    again = resume(tmp_path / "half.h5").state
    for key, values in whole.memory.items():
        assert np.array_equal(values, again.memory[key]), key
    assert np.array_equal(whole.positions, again.positions)


def test_a_run_without_history_has_no_column_and_no_memory_of_it(tmp_path: Path) -> None:
    state = block(2, {"type": "neo-hookean", **RUBBER}).build().run(record=tmp_path / "r.h5").state
    assert list(state.memory) == ["mean velocity of the step"]
    with Record(tmp_path / "r.h5") as record:
        assert DISSIPATED not in record.history


@pytest.mark.parametrize(
    ("prony", "said"),
    [
        ([], "give at least one element"),
        ([{"share": 0.6, "time": 1.0}, {"share": 0.5, "time": 2.0}], "keep them below 1"),
        ([{"share": 0.6}], "got the element"),
        ([{"share": -0.1, "time": 1.0}], "both are numbers above 0"),
        ("fast", "takes a list"),
    ],
)
def test_a_wrong_series_is_refused_in_one_line(prony: object, said: str) -> None:
    with pytest.raises(BuildError, match=said):
        block(1, {"type": "viscoelastic", **RUBBER, "prony": prony}).build()


@attrs.frozen
class Forgetful(registry.load("materials", "viscoelastic")):  # type: ignore[misc]
    """Wrong: it dissipates nothing that it tells of."""

    @staticmethod
    def dissipated(history: tuple[float, ...]) -> float:
        return 0.0 * history[-1]


def test_the_kit_catches_a_material_that_hides_its_losses() -> None:
    part = Forgetful(**RUBBER, prony=PRONY)
    failed = [one.name for one in conformance("materials", part) if not one.passed]
    assert failed == ["energy balance"]
