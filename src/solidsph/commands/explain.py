"""solidsph explain: what a run would simulate, why, and at what cost, without running it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import click

from solidsph.advice import advise
from solidsph.commands.console import Table, present, progress
from solidsph.commands.faces import face_rows, face_text
from solidsph.commands.numbers import numbers, sizes
from solidsph.commands.options import Output, flag, option, options, set_option
from solidsph.commands.prediction import (
    INTERNALS,
    build_timed,
    cluster_rows,
    prediction_rows,
    rows,
    this_machine,
    work_rows,
)
from solidsph.commands.quality import quality_rows, quality_text
from solidsph.commands.target import parameters, resolve, target_argument
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
from solidsph.scene.scene import Scene
from solidsph.scene.scheme import completed, scheme_of
from solidsph.simulation import Simulation
from solidsph.studies.case import Case
from solidsph.studies.part_values import named_parts

Facts = dict[str, Any]


@attrs.frozen
class _Options(Output):
    settings: tuple[str, ...] = set_option()
    cluster: tuple[str, ...] = option(
        "Assumption about the cluster on which a scene larger than this machine is priced: "
        "cores, memory [GiB], bandwidth [GB/s], network [GB/s], latency [us], storage [GB/s], "
        "efficiency, usable.",
        multiple=True,
        metavar="NAME=VALUE",
    )
    build: bool = flag(
        "Build the scene, however long that takes, to count its work and find its warnings.  "
        "[default: build what takes seconds, and price what is larger on paper]"
    )


@click.command()
@target_argument()
@options(_Options)
def explain(target: str, options: _Options) -> None:
    """Show what a run would simulate and cost.

    Nothing is run or written. Scenes are built in order to count their work. A large one is priced
    on paper.
    """
    wanted = resolve(target, options.settings)
    cluster = _cluster(options.cluster)
    scenes = wanted.scenes() if isinstance(wanted, Case) else {target: wanted}
    explanations: dict[str, Facts] = {}
    machine = this_machine()
    compiled: frozenset[Compilation] = frozenset()
    predictions = []
    for name, scene in scenes.items():
        with progress(options.progress):
            prediction, explanations[name] = _explained(
                scene, machine, cluster, compiled, build=options.build
            )
        compiled |= prediction.work.compilations
        predictions.append(prediction)
    facts = {
        "scenes": explanations,
        "predicted": {
            "wall time [s]": sum(p.seconds for p in predictions),
            "peak memory [MiB]": max(p.memory for p in predictions) / 2**20,
            "pair evaluations": sum(p.work.pair_evaluations for p in predictions),
        },
    }
    titles = {name: scene.title for name, scene in scenes.items()}
    present(facts, _text(facts, titles, verbose=options.verbose), as_json=options.as_json)


def _text(facts: Facts, titles: Mapping[str, str], *, verbose: bool) -> Iterator[Table | str]:
    for name, scene in facts["scenes"].items():
        yield f"\n{name}: {titles[name]}" if titles[name] else f"\n{name}"
        yield Table.of("parts", scene["parts"], ("kind", "name", "from", "why"))
        for title in ("numbers", "work", "cost", "on a cluster"):
            if scene.get(title):
                shown = [r for r in scene[title] if verbose or r["quantity"] not in INTERNALS]
                yield Table.of(title, shown, ("quantity", "value", "why"), {"quantity": ""})
        yield from face_text(scene.get("faces", ()), verbose=verbose)
        yield from quality_text(scene.get("particles", ()))
        yield from _effects_text(scene["effects"], verbose=verbose)
        if scene["probes"]:
            yield Table.of("probes", scene["probes"], ("probe", "measures", "at"))
        if scene["warnings"]:
            keys = ("name", "found", "expected", "remedy")
            yield Table.of("warnings", scene["warnings"], keys, {"name": "warning"})
            yield 'To silence a warning: silence = ["its-name"] at the top of the scene.'
        if scene["on paper"]:
            yield "Priced on paper, without its warnings; --build builds it, to count and to warn."
        if scene["silenced"]:
            yield f"silenced by the scene: {', '.join(scene['silenced'])}"
    if len(titles) > 1:
        yield Table.of_values("all scenes, one after the other", facts["predicted"])


def _effects_text(effects: Sequence[Facts], *, verbose: bool) -> Iterator[Table | str]:
    """The effects that are simulated as a table, the others in a line."""
    share, step = "share of the steps", "stable step"
    shown = [
        {
            **row,
            share: "" if row[share] is None else f"{100.0 * row[share]:.1f} %",
            step: "" if row[step] is None else f"times {row[step]:.3g}",
        }
        for row in effects
        if row["simulated"]
    ]
    if shown:
        keys = ["effect", "why", *(["arrays"] if verbose else []), "bytes", share, step]
        yield Table.of("effects", shown, keys, {share: "of the steps"})
    others = [row["effect"] for row in effects if not row["simulated"]]
    yield f"effects that the scene does not name, and does not pay for: {', '.join(others)}"


def _cluster(assumed: tuple[str, ...]) -> Cluster:
    values = parameters(assumed)
    known = [field.name for field in attrs.fields(Cluster)]
    for name in values:
        if name not in known:
            raise SceneError(f"--cluster: unknown {name!r}; known: {', '.join(known)}")
    return Cluster(**values)


# Pairs beyond which a scene is not built to be explained: that would take ten seconds and more.
_MOST_PAIRS = 5_000_000


def _explained(
    scene: Scene,
    machine: Calibration,
    cluster: Cluster,
    compiled: frozenset[Compilation],
    *,
    build: bool,
) -> tuple[Prediction, Facts]:
    try:
        prediction = predict(estimate_work(scene), machine, compiled=compiled)
    except Exception:  # a wrong part, which the build reports, or one that cannot be estimated
        prediction = None
    if prediction is not None and prediction.memory > machine_memory():
        facts = _on_paper(scene, prediction)
        facts["on a cluster"] = cluster_rows(prediction, machine, cluster)
    elif prediction is not None and prediction.work.pairs > _MOST_PAIRS and not build:
        facts = _on_paper(scene, prediction)
    else:
        simulation, timed = build_timed(scene)
        prediction = predict_run(simulation, machine, built=timed, compiled=compiled)
        facts = _built(simulation, effect_shares(simulation, machine))
    return prediction, {
        **facts,
        "work": work_rows(prediction.work),
        "cost": prediction_rows(prediction),
        "on paper": not prediction.work.counted,
        "silenced": list(scene.silence),
        "probes": [
            {"probe": probe.label, "measures": probe.quantity, "at": probe.place}
            for probe in scene.probes
        ],
    }


def _built(simulation: Simulation, effect_shares: Mapping[str, Share]) -> Facts:
    """Facts of a built scene."""
    # Parts may hold effects of their own.
    inside = {entry.name for entry in simulation.parts if entry.kind == "effects"}
    named = {registry.entry_of("effects", part).name for part in simulation.effects.values()}
    effects = []
    for label in simulation.effects:
        share = effect_shares.get(label)
        effects.append(
            _effect(
                label,
                "named by the scene",
                simulated=True,
                arrays=simulation.load_of(label).arrays,
                share=None if share is None else share.time,
                step=None if share is None else share.step,
            )
        )
    return {
        "parts": _parts(simulation.scene, simulation.parts),
        "numbers": numbers(simulation),
        "faces": face_rows(simulation),
        "particles": quality_rows(simulation),
        "effects": effects + _other_effects(named, inside),
        "warnings": [
            {"name": a.name, "found": a.finding, "expected": a.expected, "remedy": a.remedy}
            for a in advise(simulation)
        ],
    }


def _on_paper(scene: Scene, prediction: Prediction) -> Facts:
    """Facts of a scene that is not built."""
    work = prediction.work
    effects = [construct("effects", effect.part) for effect in scene.effects]
    named = [registry.entry_of("effects", part).name for part in effects]
    return {
        "parts": _parts(scene, _named_parts(scene)),
        "numbers": rows(
            ("dimensions", work.dimension, "1 is uniaxial strain, 2 is plane strain"),
            *sizes(scene),
            ("particles", work.particles, "about: volume over the cell, without ghosts"),
            ("steps", work.steps, "about: by wave speed and spacing alone"),
        ),
        "effects": [
            *(_effect(name, "named by the scene", simulated=True) for name in named),
            *_other_effects(set(named), set()),
        ],
        "warnings": [],
    }


def _named_parts(scene: Scene) -> tuple[registry.Entry, ...]:
    """The parts that a scene and its scheme name, as those of a built scene are told."""
    found = [
        registry.entry_of(kind, construct(kind, part))
        for kind, part in named_parts(completed(scene))
        if kind != "engines"
    ]
    return tuple(dict.fromkeys(found))


def _parts(scene: Scene, entries: tuple[registry.Entry, ...]) -> list[Facts]:
    return [
        {
            "kind": registry.singular(entry.kind),
            "name": entry.name or entry.target,
            "from": f"{entry.distribution} {entry.version}".strip() or "this Python session",
            "why": _why(scene, entry),
        }
        for entry in entries
    ]


# Kinds of which a scene has one part, and the field of the scene that holds it.
_SINGLE = {"kernels": "kernel", "formulations": "formulation", "integrators": "integrator"}


def _why(scene: Scene, entry: registry.Entry) -> str:
    """Why a part is used: what its scheme says of it, or that the scene names it."""
    scheme = scheme_of(scene)
    if entry.kind in _SINGLE:
        chosen = getattr(scene, _SINGLE[entry.kind]) is None
    elif entry.kind == "discretisations":
        chosen = all(body.discretisation is None for body in scene.bodies.values())
    elif entry.kind in ("gradients", "divergences"):
        return _why_operator(scene, entry)
    else:
        chosen = False
    return f"{scheme.name} scheme: {scheme.why[entry.kind]}" if chosen else "named by the scene"


def _why_operator(scene: Scene, entry: registry.Entry) -> str:
    """Why a gradient or a divergence is used."""
    scheme, kind = scheme_of(scene), registry.singular(entry.kind)
    given = scene.formulation
    table = {"type": given} if isinstance(given, str) else {} if given is None else given
    if isinstance(table, Mapping):
        if kind in table:
            own = registry.entry_of(entry.kind, construct(entry.kind, table[kind]))
            return "named by the scene" if entry == own else "part of the formulation"
        if table.get("type", scheme.formulation["type"]) == scheme.formulation["type"]:
            if entry.name == scheme.formulation[kind]:
                return f"{scheme.name} scheme: {scheme.why[entry.kind]}"
            if kind == "gradient" and entry.name == scheme.elsewhere:
                return f"{scheme.name} scheme: {scheme.why['elsewhere']}"
    return "part of the formulation"


def _effect(
    name: str,
    why: str,
    *,
    simulated: bool,
    arrays: Mapping[str, int] | None = None,
    share: float | None = None,
    step: float | None = None,
) -> Facts:
    """Facts of an effect, with the bytes of its arrays by name."""
    arrays = arrays or {}
    return {
        "effect": name,
        "simulated": simulated,
        "why": why,
        "arrays": ", ".join(arrays),
        "bytes": sum(arrays.values()),
        "share of the steps": share,
        "stable step": step,
    }


def _other_effects(named: set[str], inside: set[str]) -> list[Facts]:
    """Effects that the scene does not name; those inside another part are simulated."""
    return [
        _effect(
            name,
            "needed by another part" if name in inside else "not named by the scene",
            simulated=name in inside,
        )
        for name in registry.names("effects")
        if name not in named
    ]
