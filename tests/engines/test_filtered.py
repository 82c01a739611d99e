"""Bodies that filter their dilatation: every engine agrees with the matrix engine, forces are the
derivative of the energy, and keep momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba.core.config import NUMBA_NUM_THREADS

from solidsph import BuildError
from solidsph.engines.compiled.fixed import partition
from solidsph.engines.compiled.time_loop.loop import CompiledLoop
from solidsph.maths.arrays import Array
from solidsph.run.step_by_step import StepByStep
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import example_part
from tests.engines.test_time_loop import STEPS, assert_agree, assert_same, loops, stretched
from tests.helpers.scenes import box

RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.49, "density": 1000.0}
FLOWING = {"type": "j2-plasticity", **RUBBER, "yield_stress": 2e4, "hardening": 1e5}
LINEAR = {"type": "linear-elastic", **RUBBER}
NEO_HOOKEAN = {"type": "neo-hookean", **RUBBER}
GHOSTS = {"type": "lattice", "on_boundary": True, "ghosts": 3, "ghost_faces": ["left"]}


def filtering(d: int, cells: int, material: dict[str, Any], **body: Any) -> SceneBuilder:
    return (
        box(d, cells, **body).material(material).formulation("total-lagrangian", filter_above=10.0)
    )


@pytest.mark.parametrize(
    ("d", "material"),
    [
        (2, NEO_HOOKEAN),
        pytest.param(3, NEO_HOOKEAN, marks=pytest.mark.validation),
        (2, FLOWING),
        pytest.param(3, FLOWING, marks=pytest.mark.validation),
        pytest.param(2, LINEAR, marks=pytest.mark.validation),
    ],
    ids=lambda value: value["type"] if isinstance(value, dict) else None,
)
def test_the_loop_steps_as_the_parts_do(d: int, material: dict[str, Any]) -> None:
    builder = filtering(d, 7, material).boundary("clamp", where="left")
    simulation = stretched(builder).build()
    assert simulation.model.filters
    assert_agree(builder)


@pytest.mark.skipif(NUMBA_NUM_THREADS < 2, reason="there is one thread only")
def test_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(partition, "WORTH_A_THREAD", 1)
    simulation, loop, by_step = loops(filtering(2, 30, NEO_HOOKEAN))
    assert loop.threads > 1
    state = simulation.start()
    ours = loop.advance(state, 4)
    assert_same(ours, by_step.advance(state, 4), simulation)
    assert np.array_equal(ours.positions, loop.advance(state, 4).positions)


def test_ghosts_neither_count_nor_change() -> None:
    builder = filtering(2, 8, NEO_HOOKEAN, discretisation=GHOSTS).boundary("symmetry", axis="x")
    by_engine = []
    for engine in ("matrix", "compiled"):
        simulation = stretched(builder).engine(engine).build()
        loop = simulation.time_loop()
        by_engine.append(loop.advance(simulation.start(), STEPS))
    assert_same(*by_engine, simulation)
    (body,) = simulation.model.bodies
    rows = body.dilatation_filter.smooth_part.rows
    assert not abs(rows[body.particles.ghosts]).sum()
    assert not abs(rows[:, body.particles.ghosts]).sum()


@pytest.mark.validation  # half a minute of compiling
def test_single_precision() -> None:
    builder = stretched(filtering(2, 7, NEO_HOOKEAN).boundary("clamp", where="left"))
    simulation, single = builder.build(), builder.engine("compiled-float32").build()
    loop = single.time_loop()
    assert isinstance(loop, CompiledLoop)
    X = simulation.particles.positions
    ours = loop.advance(single.start(), STEPS).positions - X
    by_step = StepByStep(simulation.dynamics, simulation.integrator)
    theirs = by_step.advance(simulation.start(), STEPS).positions - X
    # As of a body that does not filter (tests/engines/test_time_loop.py).
    assert 1e-12 < np.abs(ours - theirs).max() / np.abs(theirs).max() < 1e-5


def rough(simulation: Any, seed: int) -> Array:
    shape = simulation.particles.positions.shape
    spacing = simulation.particles.spacings.min()
    return 0.02 * spacing * np.random.default_rng(seed).normal(size=shape)


@pytest.mark.parametrize("material", [NEO_HOOKEAN, LINEAR], ids=lambda one: one["type"])
@pytest.mark.parametrize("d", [2, 3])
def test_forces_are_the_derivative_of_the_energy(d: int, material: dict[str, Any]) -> None:
    simulation = filtering(d, 5, material).engine("matrix").build()
    internal = simulation.dynamics.internal
    volumes = simulation.particles.volumes
    u, way = rough(simulation, 0), rough(simulation, 1)

    def energy(share: float) -> float:
        return float(volumes @ internal.fields(u + share * way).energy_densities)

    # A fourth-order difference quotient: errors of both kinds are some 1e-11 of the energy's slope.
    e = 1e-3
    slope = (8 * (energy(e) - energy(-e)) - energy(2 * e) + energy(-2 * e)) / (12 * e)
    work = -float(np.sum(internal.forces(0.0, u) * way))
    assert work == pytest.approx(slope, rel=1e-8)


def test_momentum_and_its_moment_are_kept() -> None:
    simulation = filtering(2, 6, NEO_HOOKEAN).engine("matrix").build()
    X, u = simulation.particles.positions, rough(simulation, 0)
    forces = simulation.dynamics.internal.forces(0.0, u)
    x, size = X + u, np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() <= 1e-13 * size
    moment = np.sum(x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0])
    assert abs(moment) <= 1e-13 * size


def test_a_softer_material_is_left_as_it_is() -> None:
    soft = {**NEO_HOOKEAN, "poissons_ratio": 0.45}  # lambda / mu = 9
    assert not filtering(2, 5, soft).build().model.filters
    assert filtering(2, 5, {**soft, "poissons_ratio": 0.46}).build().model.filters


def test_of_a_bar_there_is_nothing_to_filter() -> None:
    assert not filtering(1, 9, NEO_HOOKEAN).build().model.filters


@pytest.mark.parametrize(
    ("given", "told"),
    [(-1.0, "filter_above must not be negative, got -1.0"), ("many", "filter_above")],
)
def test_a_wrong_threshold_is_told(given: object, told: str) -> None:
    with pytest.raises(BuildError, match=told):
        box(2, 5).formulation("total-lagrangian", filter_above=given).build()


def test_what_changes_the_forces_of_a_body_that_filters_is_refused() -> None:
    builder = filtering(2, 7, NEO_HOOKEAN).effect(example_part("effects", "bond-failure"))
    with pytest.raises(BuildError, match="give the formulation filter_above = inf"):
        builder.build()
