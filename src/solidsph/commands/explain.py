"""solidsph explain: what a run would simulate, why, and at what cost, without running it."""

from __future__ import annotations

import time as clock
from typing import Any

import attrs
import click
import numpy as np

from solidsph import registry
from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.target import resolve
from solidsph.interfaces.case import Case
from solidsph.scene import BodyScene, Scene
from solidsph.simulation import Simulation
from solidsph.statics import critical_step, tangent
from solidsph.statics.factors import SingularError, factorised
from solidsph.statics.freedoms import Freedoms, freedoms
from solidsph.statics.tangent import is_symmetric
from solidsph.time_loop import StepByStep, StepError

_TIMED = 0.1  # [s]


@click.command()
@click.argument("target", metavar="SCENE|CASE")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A case's parameter.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def explain(target: str, settings: tuple[str, ...], as_json: bool) -> None:
    """Say what would be simulated, why, and at what cost. Nothing is run or written."""
    wanted = resolve(target, settings)
    scenes = wanted.scenes() if isinstance(wanted, Case) else {target: wanted}
    explanations = {name: _explained(scene) for name, scene in scenes.items()}
    if as_json:
        show_json({"scenes": explanations})
        return
    for name, facts in explanations.items():
        say(f"\n{name}: {scenes[name].title}" if scenes[name].title else f"\n{name}")
        show_table(
            "parts", ["kind", "name", "from", "why"], [list(row.values()) for row in facts["parts"]]
        )
        show_table(
            "numbers", ["", "value", "why"], [list(row.values()) for row in facts["numbers"]]
        )
        show_table(
            "effects",
            ["effect", "simulated", "why", "arrays [bytes]"],
            [list(row.values()) for row in facts["effects"]],
        )


def _explained(scene: Scene) -> dict[str, Any]:
    from solidsph.builder import Builder

    simulation = Builder(scene).build()
    return {
        "parts": [
            {
                "kind": registry.singular(entry.kind),
                "name": entry.name or entry.target,
                "from": f"{entry.distribution} {entry.version}".strip() or "this Python session",
                "why": _why(scene, entry),
            }
            for entry in simulation.parts
        ],
        "numbers": _numbers(simulation),
        "effects": _effects(simulation),
    }


_DEFAULT = "the default: the scene names no other"

# Kinds of which a scene has one, and the field of the scene that holds it.
_SINGLE = {"kernels": "kernel", "formulations": "formulation", "integrators": "integrator"}
_INSIDE = {"gradients": "part of the formulation", "divergences": "part of the formulation"}


def _why(scene: Scene, entry: registry.Entry) -> str:
    if entry.kind in _SINGLE:
        wanted = getattr(scene, _SINGLE[entry.kind])
        if wanted == getattr(attrs.fields(Scene), _SINGLE[entry.kind]).default:
            return _DEFAULT
    default = attrs.fields(BodyScene).discretisation.default
    if entry.kind == "discretisations" and all(
        body.discretisation == default for body in scene.bodies.values()
    ):
        return _DEFAULT
    return _INSIDE.get(entry.kind, "named by the scene")


def _numbers(simulation: Simulation) -> list[dict[str, Any]]:
    scene, setting = simulation.scene, simulation.setting
    particles = setting.particles
    pairs = simulation.dynamics.internal.pair_count
    neighbours = pairs / particles.count - 1.0
    speed = max(body.material.wave_speed for body in setting.bodies)
    d = particles.dimension
    rows = [
        ("dimensions", d, "1 is uniaxial strain, 2 is plane strain"),
        ("particles", int((~particles.ghosts).sum()), "from shapes and spacings"),
        ("ghosts", int(particles.ghosts.sum()), "complete the support of those near a surface"),
        ("neighbours", neighbours, f"a particle's, on average, within {scene.cover:g} spacings"),
        ("confined wave speed [m/s]", speed, "sqrt((lambda + 2 mu) / rho), the fastest body's"),
        ("engine", type(simulation.dynamics.internal).__name__, f'engine = "{scene.engine}"'),
        *(_of_motion(simulation) if scene.statics is None else _of_statics(simulation)),
    ]
    return [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def _of_motion(simulation: Simulation) -> list[tuple[str, Any, str]]:
    scene = simulation.scene
    stated = scene.time_step is not None
    margin = critical_step(simulation).margin
    outputs = len(simulation.output_steps()) + 1
    return [
        (
            "time step [s]",
            simulation.step_size,
            "as the scene states it"
            if stated
            else f"{scene.time_step_factor:g} of the CFL step, by wave speed and spacing",
        ),
        (
            "critical step over it",
            margin,
            "from the highest frequency of the discrete system at the start"
            if margin >= 1.0
            else "BELOW 1: the run will blow up; take a smaller time_step_factor",
        ),
        ("steps", simulation.steps, f"for {scene.duration:g} s"),
        _loop(simulation),
        (
            "predicted wall time [s]",
            _seconds_per_step(simulation) * simulation.steps,
            "some steps timed here and now, without outputs and compiling",
        ),
        _record_size(simulation, outputs),
    ]


def _of_statics(simulation: Simulation) -> list[tuple[str, Any, str]]:
    wanted = simulation.scene.statics
    assert wanted is not None
    own = freedoms(simulation.dynamics)
    return [
        ("free displacements", own.count, "unknowns of Newton's method"),
        ("load steps", wanted.load_steps, "to begin with: halved on failure, doubled on success"),
        ("tolerance", wanted.tolerance, "imbalance of forces over loads and reactions"),
        (
            "predicted time of an iteration [s]",
            _seconds_per_iteration(simulation, own),
            "one tangent built and factorised here and now; some five a load step",
        ),
        _record_size(simulation, wanted.load_steps + 1),
    ]


def _record_size(simulation: Simulation, outputs: int) -> tuple[str, Any, str]:
    d, count = simulation.particles.dimension, simulation.particles.count
    return (
        "record [MiB]",
        outputs * count * 8 * (7 + d + d * d) / 2**20,
        f"{outputs} outputs of position, velocity, stress and volume ratio, about",
    )


def _seconds_per_step(simulation: Simulation) -> float:
    """Without what is done once for all steps together; not a number if it fails at once."""
    loop = simulation.time_loop()
    count, taken = 1, 0.0
    try:
        state = loop.advance(simulation.start(), 1)  # compiles what is to be compiled
        while taken < _TIMED:
            count *= 2
            begun = clock.perf_counter()
            loop.advance(state, 1 + count)
            taken = clock.perf_counter() - begun
    except StepError:
        return float("nan")
    return taken / count


def _loop(simulation: Simulation) -> tuple[str, str, str]:
    if isinstance(simulation.time_loop(), StepByStep):
        return ("time loop", "step by step", "each step by the parts themselves, which fits all")
    return ("time loop", "compiled", "whole steps together: all parts are of declared kinds")


def _seconds_per_iteration(simulation: Simulation, own: Freedoms) -> float:
    begun = clock.perf_counter()
    K = tangent(simulation, np.zeros_like(simulation.particles.positions))
    try:
        factorised(own.reduced(K), symmetric=own.adjoint and is_symmetric(simulation))
    except SingularError:
        return float("nan")  # nothing holds the body: the run will say so
    return clock.perf_counter() - begun


def _effects(simulation: Simulation) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    named = set()
    for label, effect in simulation.effects.items():
        name = registry.entry_of("effects", effect).name
        named.add(name)
        rows.append(
            {
                "effect": label,
                "simulated": True,
                "why": "named by the scene",
                "arrays": sum(effect.arrays(simulation.setting).values()),
            }
        )
    rows += [
        {"effect": name, "simulated": False, "why": "not named by the scene", "arrays": 0}
        for name in registry.names("effects")
        if name not in named
    ]
    return rows
