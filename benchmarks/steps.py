"""Whole time steps: a run through the public interface, one-off costs taken away."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median

import attrs
import numba
from bodies import ARRANGEMENTS, COVER, MATERIAL, SPACING, shape
from comparison import BLOCK
from table import Table

from solidsph import Simulation
from solidsph.scene.scene_builder import SceneBuilder

REPEATS = 5


@attrs.frozen
class Scene:
    """Something to run."""

    builder: Callable[[], SceneBuilder]
    time_step: float  # within the CFL step [s]
    steps: int  # by which the longer run is longer
    engines: tuple[str, ...]


def bar() -> SceneBuilder:
    """A bar of 61 particles with a pulse: what a step costs when there is next to nothing in it."""
    return (
        Simulation.builder()
        .body(
            "bar",
            shape={"type": "interval", "length": 0.15},
            spacing=2.5e-3,
            discretisation={"type": "lattice", "on_boundary": True},
        )
        .kernel("modified-mollifier", cover=5.5)
        .material("neo-hookean", density=8000.0, youngs_modulus=200e9, poissons_ratio=0.3)
        .formulation("total-lagrangian")
        .boundary("clamp", where="right")
        .initial(velocity={"x": "exp(-((X - 0.05)/0.01)**2)"})
    )


def beam() -> SceneBuilder:
    """The Turek-Hron beam of the tests, 9 particles across."""
    return (
        Simulation.builder()
        .body(
            "beam",
            shape={"type": "box", "lengths": [0.35, 0.02], "origin": [0.0, -0.01]},
            spacing=0.02 / 8,
            discretisation={
                "type": "fitted-moments",
                "of": {"type": "lattice", "on_boundary": True},
            },
        )
        .kernel("modified-mollifier", cover=3.5)
        .material("saint-venant-kirchhoff", youngs_modulus=1.4e6, poissons_ratio=0.4, density=1e3)
        .formulation("total-lagrangian", gradient="quadratic")
        .boundary("clamp", where="left")
        .effect("body-force", acceleration={"y": -2.0})
    )


def block() -> SceneBuilder:
    """The block of the yardstick, clamped and given the velocity of a bending wave."""
    return (
        Simulation.builder()
        .body(
            "block",
            shape=shape(BLOCK),
            spacing=SPACING,
            discretisation=ARRANGEMENTS["lattice"],
        )
        .kernel("cubic-spline", cover=COVER)
        .material(MATERIAL)
        .formulation("total-lagrangian")
        .boundary("clamp", where="left")
        .initial(velocity={"y": "0.01*sqrt(2e6/1000)*sin(0.5*pi*X/0.4)"})
    )


SCENES: Mapping[str, Scene] = {
    "1D bar, 61 particles": Scene(bar, 3e-7, 2000, ("matrix", "compiled")),
    "2D beam, 9 across": Scene(beam, 2.5e-5, 500, ("matrix", "compiled")),
    "3D block, 40 x 40 x 64": Scene(block, 1e-4, 20, ("compiled", "compiled-float32")),
}


def whole_steps(engines: list[str], threads: list[int]) -> Table:
    """Time of a step of each scene by each engine."""
    rows = []
    for name, scene in SCENES.items():
        for engine in scene.engines:
            if engine.partition("-")[0] not in engines:
                continue
            # One thread is all that the matrix engine has, and all that small bodies are given.
            for count in threads if "block" in name else threads[:1]:
                numba.set_num_threads(count)
                rows.append((name, engine, f"{count}", *_row(scene, engine)))
    return Table(
        "Whole time steps: `Simulation.run`, one output at the end",
        ("scene", "engine", "threads", "particles", "us a step", "ns a pair"),
        tuple(rows),
        "The difference of a long and a short run, divided by the steps that it is longer: what "
        "starting, observing and compiling take is in both.",
    )


def _row(scene: Scene, engine: str) -> tuple[str, ...]:
    short, long = (_run_of(scene, engine, steps) for steps in (1, 1 + scene.steps))
    short.run()  # compiles
    costs = []
    for _ in range(REPEATS):
        less, more = short.run().seconds, long.run().seconds
        costs.append((more - less) / (long.steps - short.steps))
    cost = median(costs)
    pairs = short.dynamics.internal.pair_count
    count = short.particles.count
    return f"{count}", f"{1e6 * cost:.1f}", f"{1e9 * cost / pairs:.1f}"


def _run_of(scene: Scene, engine: str, steps: int) -> Simulation:
    return (
        scene.builder()
        .integrator("central-difference", time_step=scene.time_step)
        .engine(engine)
        .duration(steps * scene.time_step)
        .outputs(1)
        .build()
    )
