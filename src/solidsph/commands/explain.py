"""solidsph explain: what a run would simulate, why, and at what cost, without running it."""

from __future__ import annotations

import time as clock
from typing import Any

import attrs
import click

from solidsph import registry
from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.target import resolve
from solidsph.interfaces.case import Case
from solidsph.scene import BodyScene, Scene
from solidsph.simulation import Simulation
from solidsph.statics import critical_step

_TIMED_STEPS = 5


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
            "parts", ["kind", "name", "from"], [list(row.values()) for row in facts["parts"]]
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
    per_step = _seconds_per_step(simulation)
    stated = scene.time_step is not None
    outputs = len(simulation.output_steps()) + 1
    d = particles.dimension
    margin = critical_step(simulation).margin
    rows = [
        ("dimensions", d, "1 is uniaxial strain, 2 is plane strain"),
        ("particles", int((~particles.ghosts).sum()), "from shapes and spacings"),
        ("ghosts", int(particles.ghosts.sum()), "complete the support of those near a surface"),
        ("neighbours", neighbours, f"a particle's, on average, within {scene.cover:g} spacings"),
        ("confined wave speed [m/s]", speed, "sqrt((lambda + 2 mu) / rho), the fastest body's"),
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
        (
            "engine",
            type(simulation.dynamics.internal).__name__,
            f'engine = "{scene.engine}"',
        ),
        (
            "predicted wall time [s]",
            per_step * simulation.steps,
            f"{_TIMED_STEPS} steps timed here and now, without outputs and compiling",
        ),
        (
            "record [MiB]",
            outputs * particles.count * 8 * (7 + d + d * d) / 2**20,
            f"{outputs} outputs of position, velocity, stress and volume ratio, about",
        ),
    ]
    return [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def _seconds_per_step(simulation: Simulation) -> float:
    loop = simulation.time_loop()
    state = loop.advance(simulation.start(), 1)  # compiles what is to be compiled
    begun = clock.perf_counter()
    loop.advance(state, 1 + _TIMED_STEPS)
    return (clock.perf_counter() - begun) / _TIMED_STEPS


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
