"""solidsph explain: what a run would simulate, why, and at what cost, without running it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import click

from solidsph.advice import advised
from solidsph.commands import prediction as told
from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.target import parameters, resolve
from solidsph.costs.calibration import Calibration
from solidsph.costs.cluster import Cluster
from solidsph.costs.effect_shares import Share, effect_shares
from solidsph.costs.estimate import estimate_work
from solidsph.costs.model import Prediction, predict
from solidsph.costs.prediction import predict_run
from solidsph.costs.process import machine_memory
from solidsph.errors import SceneError
from solidsph.interfaces.plan import Compilation
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import DEFAULT_INTEGRATOR, BodyScene
from solidsph.simulation import Simulation
from solidsph.statics import critical_step
from solidsph.statics.freedoms import freedoms
from solidsph.studies.case import Case


@click.command()
@click.argument("target", metavar="SCENE|-|CASE")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A case's parameter.")
@click.option(
    "--cluster",
    "assumed",
    multiple=True,
    metavar="NAME=VALUE",
    help="An assumption on the cluster by which a scene larger than this machine is priced: "
    "cores, memory [GiB], bandwidth [GB/s], network [GB/s], latency [us], storage [GB/s], "
    "efficiency, usable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def explain(
    target: str, settings: tuple[str, ...], assumed: tuple[str, ...], as_json: bool
) -> None:
    """Say what would be simulated, why, and at what cost. Nothing is run or written.

    Scenes are built, to be counted; one that needs more memory than this machine has is priced
    on paper.
    """
    wanted = resolve(target, settings)
    cluster = _cluster(assumed)
    scenes = wanted.scenes() if isinstance(wanted, Case) else {target: wanted}
    explanations: dict[str, dict[str, Any]] = {}
    machine = told.calibrated()
    compiled: set[Compilation] = set()
    predictions = []
    for name, scene in scenes.items():
        found, explanations[name] = _explained(scene, machine, cluster, frozenset(compiled))
        compiled |= found.work.compilations
        predictions.append(found)
    if as_json:
        show_json({"scenes": explanations, "predicted": _together(predictions)})
        return
    for name, facts in explanations.items():
        say(f"\n{name}: {scenes[name].title}" if scenes[name].title else f"\n{name}")
        show_table(
            "parts", ["kind", "name", "from", "why"], [list(row.values()) for row in facts["parts"]]
        )
        for title in ("numbers", "work", "cost", "on a cluster"):
            if facts.get(title):
                rows = [list(row.values()) for row in facts[title]]
                show_table(title, ["", "value", "why"], rows)
        show_table(
            "effects",
            ["effect", "simulated", "why", "arrays", "bytes", "of the steps", "stable step"],
            [[*list(row.values())[:5], *_shares_shown(row)] for row in facts["effects"]],
        )
        _show_advice(facts)
    if len(predictions) > 1:
        rows = [[key, value] for key, value in _together(predictions).items()]
        show_table("all scenes, one after the other", ["", "value"], rows)


def _shares_shown(row: Mapping[str, Any]) -> tuple[str, str]:
    share, step = row["share of the steps"], row["stable step"]
    return (
        "" if share is None else f"{100.0 * share:.1f} %",
        "" if step is None else f"times {step:.3g}",
    )


def _show_advice(facts: Mapping[str, Any]) -> None:
    silenced = facts["silenced"]
    if facts["warnings"]:
        show_table(
            "warnings",
            ["warning", "found", "expected", "remedy"],
            [list(row.values()) for row in facts["warnings"]],
        )
        say('To silence one: silence = ["its-name"] at the top of the scene.')
    if silenced:
        say(f"silenced by the scene: {', '.join(silenced)}")


def _cluster(assumed: tuple[str, ...]) -> Cluster:
    values = parameters(assumed)
    known = [field.name for field in attrs.fields(Cluster)]
    for name in values:
        if name not in known:
            raise SceneError(f"--cluster: unknown {name!r}; known: {', '.join(known)}")
    return Cluster(**values)


def _together(predictions: list[Prediction]) -> dict[str, float]:
    return {
        "wall time [s]": sum(one.seconds for one in predictions),
        "peak memory [MiB]": max(one.memory for one in predictions) / 2**20,
        "pair evaluations": sum(one.work.pair_evaluations for one in predictions),
    }


def _explained(
    scene: Scene, machine: Calibration, cluster: Cluster, compiled: frozenset[Compilation]
) -> tuple[Prediction, dict[str, Any]]:
    on_paper = _on_paper(scene, machine, compiled)
    if on_paper is not None and on_paper.memory > machine_memory():
        return on_paper, _too_large(scene, on_paper, machine, cluster)
    simulation, build = told.built(scene)
    found = predict_run(simulation, machine, built=build, compiled=compiled)
    return found, {
        "parts": _parts(scene, simulation.parts),
        "numbers": _numbers(simulation),
        "work": told.work_rows(found.work),
        "cost": told.prediction_rows(found),
        "effects": _effects(simulation.effects, simulation, effect_shares(simulation, machine)),
        "warnings": [
            {"name": a.name, "found": a.found, "expected": a.expected, "remedy": a.remedy}
            for a in advised(simulation)
        ],
        "silenced": list(scene.silence),
    }


def _on_paper(
    scene: Scene, machine: Calibration, compiled: frozenset[Compilation]
) -> Prediction | None:
    """A first estimate; nothing where a part is wrong or strange, which the build will tell."""
    try:
        return predict(estimate_work(scene), machine, compiled=compiled)
    except Exception:
        return None


def _too_large(
    scene: Scene, found: Prediction, machine: Calibration, cluster: Cluster
) -> dict[str, Any]:
    work = found.work
    rows = [
        ("dimensions", work.dimension, "1 is uniaxial strain, 2 is plane strain"),
        ("particles", work.particles, "about: volume over the cell, ghosts left out"),
        ("steps", work.steps, "about: by wave speed and spacing alone"),
    ]
    _, priced = told.cluster_rows(found, machine, cluster)
    effects = {
        one.label or str(k): construct("effects", one.part) for k, one in enumerate(scene.effects)
    }
    return {
        "parts": _parts(scene, _named(scene)),
        "numbers": [{"quantity": name, "value": value, "why": why} for name, value, why in rows],
        "work": told.work_rows(work),
        "cost": told.prediction_rows(found),
        "on a cluster": priced,
        "effects": _effects(effects, None, {}),
        "warnings": [],
        "silenced": list(scene.silence),
    }


def _named(scene: Scene) -> tuple[registry.Entry, ...]:
    """The parts that a scene names, without what is inside of them."""
    wanted: list[tuple[str, Any]] = [
        ("kernels", scene.kernel),
        ("formulations", scene.formulation),
        ("integrators", scene.integrator or DEFAULT_INTEGRATOR),
        *(("boundaries", one.part) for one in scene.boundaries),
        *(("effects", one.part) for one in scene.effects),
    ]
    for body in scene.bodies.values():
        material = body.material if body.material is not None else scene.material
        wanted += [("shapes", body.shape), ("discretisations", body.discretisation)]
        wanted += [("materials", material)]
    made = [(kind, construct(kind, part)) for kind, part in wanted]
    return tuple(dict.fromkeys(registry.entry_of(kind, part) for kind, part in made))


def _parts(scene: Scene, entries: tuple[registry.Entry, ...]) -> list[dict[str, Any]]:
    return [
        {
            "kind": registry.singular(entry.kind),
            "name": entry.name or entry.target,
            "from": f"{entry.distribution} {entry.version}".strip() or "this Python session",
            "why": _why(scene, entry),
        }
        for entry in entries
    ]


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
    scene, model = simulation.scene, simulation.model
    particles = model.particles
    pairs = simulation.dynamics.internal.pair_count
    neighbours = pairs / particles.count - 1.0
    speed = max(body.material.wave_speed for body in model.bodies)
    d = particles.dimension
    rows = [
        ("dimensions", d, "1 is uniaxial strain, 2 is plane strain"),
        ("particles", int((~particles.ghosts).sum()), "from shapes and spacings"),
        ("ghosts", int(particles.ghosts.sum()), "complete the support of those near a surface"),
        ("neighbours", neighbours, "a particle's, on average, within the support"),
        ("cover [spacings]", cover_of(scene), _why_cover(scene)),
        *_hidden(simulation),
        ("confined wave speed [m/s]", speed, "sqrt((lambda + 2 mu) / rho), the fastest body's"),
        ("engine", type(simulation.dynamics.internal).__name__, f'engine = "{scene.engine}"'),
        *(_of_motion(simulation) if scene.statics is None else _of_statics(simulation)),
    ]
    return [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def _why_cover(scene: Scene) -> str:
    if scene.cover is not None:
        return "support radius, named by the scene"
    return "support radius; the kernel's own, the largest that holds neighbours in a row"


def _hidden(simulation: Simulation) -> list[tuple[str, Any, str]]:
    """Pairs of near particles that are no neighbours, where there are any."""
    found = [body.hidden for body in simulation.model.bodies if body.hidden is not None]
    count = sum(len(one.keys) for one in found) // 2
    why = "near, but no neighbours: their straight line leaves the body"
    return [("pairs across gaps", count, why)] if count else []


def _of_motion(simulation: Simulation) -> list[tuple[str, Any, str]]:
    scene = simulation.scene
    stated = scene.time_step is not None
    margin = critical_step(simulation).margin
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
        *_sleep(scene),
        _loop(simulation),
    ]


def _sleep(scene: Scene) -> list[tuple[str, Any, str]]:
    if scene.sleep is None:
        return []
    why = (
        f"slabs slower than {scene.sleep.tolerance:g} of the largest speed sleep, and cost nothing"
    )
    return [("sleep", f"up to {scene.sleep.slabs} slabs", why)]


def _of_statics(simulation: Simulation) -> list[tuple[str, Any, str]]:
    wanted = simulation.scene.statics
    assert wanted is not None
    own = freedoms(simulation.dynamics)
    return [
        ("free displacements", own.count, "unknowns of Newton's method"),
        ("load steps", wanted.load_steps, "to begin with: halved on failure, doubled on success"),
        ("tolerance", wanted.tolerance, "imbalance of forces over loads and reactions"),
    ]


def _loop(simulation: Simulation) -> tuple[str, str, str]:
    if simulation.plan.compiles_steps:
        return ("time loop", "compiled", "whole steps together: all parts are of declared kinds")
    return ("time loop", "step by step", "each step by the parts themselves, which fits all")


def _effects(
    effects: Mapping[str, Any], simulation: Simulation | None, found: Mapping[str, Share]
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    named = {label: registry.entry_of("effects", one).name for label, one in effects.items()}
    for label in effects:
        arrays = {} if simulation is None else simulation.load_of(label).arrays
        share = found.get(label)
        rows.append(
            {
                "effect": label if simulation is not None else named[label],
                "simulated": True,
                "why": "named by the scene",
                "arrays": ", ".join(arrays),
                "bytes": sum(arrays.values()),
                "share of the steps": None if share is None else share.time,
                "stable step": None if share is None else share.step,
            }
        )
    # Parts may hold effects of their own.
    inside = {e.name for e in simulation.parts if e.kind == "effects"} if simulation else set()
    for name in registry.names("effects"):
        if name in named.values():
            continue
        needed = name in inside
        rows.append(
            {
                "effect": name,
                "simulated": needed,
                "why": "needed by another part" if needed else "not named by the scene",
                "arrays": "",
                "bytes": 0,
                "share of the steps": None,
                "stable step": None,
            }
        )
    return rows
