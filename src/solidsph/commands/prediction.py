"""Predictions as commands show them: before a run, and held against it afterwards."""

from __future__ import annotations

import subprocess
import time as clock
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import click

from solidsph.costs import calibration
from solidsph.costs.calibration import Calibration
from solidsph.costs.cluster import Cluster, ClusterEstimate, estimate_on_cluster
from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.model import Built, Prediction
from solidsph.costs.prediction import predict_run
from solidsph.costs.process import excess_load, machine_memory, memory_now, peak_memory
from solidsph.costs.work import Work
from solidsph.interfaces.plan import Compilation
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation

if TYPE_CHECKING:
    from solidsph.studies.case_run import SceneRun

LONG = 5.0
"""Runs that are predicted to take longer are announced [s]."""

# For what takes less than this, no machine is measured to say so [s].
_NOT_WORTH_IT = 2.0

Row = dict[str, Any]


def built(scene: Scene) -> tuple[Simulation, Built]:
    """A scene built, and what that took."""
    begun = clock.perf_counter()
    simulation = Simulation.builder(scene).build()
    seconds = clock.perf_counter() - begun
    return simulation, Built(seconds, peak_memory(), memory_now())


def calibrated() -> Calibration:
    """This machine; where it cannot be measured, the one that the coefficients were measured on."""
    try:
        return calibration.this_machine()
    except (OSError, ValueError, subprocess.SubprocessError) as cause:
        click.echo(f"this machine could not be calibrated ({cause}): a reference is used", err=True)
        return REFERENCE


def of_run(
    simulation: Simulation, build: Built | None, compiled: Collection[Compilation] = ()
) -> Prediction | None:
    """What a built scene will take, or nothing: to predict must never be why a run fails.

    The machine is calibrated only where there is something worth predicting.
    """
    try:
        about = predict_run(simulation, REFERENCE, built=build, compiled=compiled)
        known = calibration.cached_calibration()
        if known is None and about.run_seconds < _NOT_WORTH_IT:
            return about
        machine = known or calibrated()
        return predict_run(simulation, machine, built=build, compiled=compiled)
    except Exception:
        return None


def announcement(prediction: Prediction) -> str:
    """One line before a long run."""
    parts = ", ".join(f"{name} {seconds:.2g}" for name, seconds in prediction.parts.items())
    return (
        f"predicted: {prediction.seconds:.3g} s ({parts}), "
        f"{prediction.memory / 2**20:.0f} MiB at the peak"
    )


def work_rows(work: Work) -> list[Row]:
    """What is to be done, the same on every machine."""
    how = "counted" if work.counted else "estimated from volumes and the support, nothing is built"
    rows: list[tuple[str, Any, str]] = [
        ("pairs", work.pairs, f"ordered, a particle its own neighbour too; {how}"),
        ("pairs an evaluation visits", work.visited, "with those of loads and effects"),
        ("evaluations of the forces", work.evaluations, _why_so_many(work)),
        ("pair evaluations", work.pair_evaluations, "visited pairs times evaluations"),
        ("bytes an evaluation touches", work.touched, "once at least, whatever the caches are"),
        ("bytes touched in all", work.traffic, "times evaluations"),
        ("bytes held", work.held, "of arrays kept between evaluations"),
        ("outputs", work.outputs, "observed states, the first one among them"),
        ("record [MiB]", work.record_bytes / 2**20, "position, velocity, stress, volume ratio"),
    ]
    if work.statics is not None:
        rows += [
            ("iterations", work.statics.iterations, "of Newton's method, a guess"),
            ("entries of the factors", work.statics.fill, "by nested dissection of the box"),
        ]
    return [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def _why_so_many(work: Work) -> str:
    if work.statics is not None:
        return "one an iteration and one a load step, at least"
    return "one a step, and one at the start"


def prediction_rows(prediction: Prediction) -> list[Row]:
    """Seconds and bytes on this machine."""
    share = {name: seconds / prediction.seconds for name, seconds in prediction.parts.items()}
    own = "measured just now" if prediction.measured_build else "predicted"
    whys = {
        "build": f"{own}: particles, neighbours, operators",
        "compile": "what this scene has compiled, each once a process",
        "steps": "coefficients of benchmarks/fit_costs.py times this machine's calibration",
        "outputs": "observing, and writing the record",
    }
    rows: list[tuple[str, Any, str]] = [
        ("predicted wall time [s]", prediction.seconds, _limited(prediction)),
        *(
            (f"  {name} [s]", seconds, f"{100 * share[name]:.0f} %, {whys[name]}")
            for name, seconds in prediction.parts.items()
        ),
        (
            "predicted peak memory [MiB]",
            prediction.memory / 2**20,
            f"of {machine_memory() / 2**30:.3g} GiB that this machine has",
        ),
    ]
    return [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def _limited(prediction: Prediction) -> str:
    text = f"limited by: {prediction.limit}"
    busy = excess_load()
    return text if busy < 0.5 else f"{text}; {busy:.1f} other programs want a core: it takes longer"


def cluster_rows(
    prediction: Prediction, machine: Calibration, cluster: Cluster
) -> tuple[ClusterEstimate, list[Row]]:
    """A scene larger than this machine, on paper."""
    price = estimate_on_cluster(prediction, machine, cluster)
    a = attrs.asdict(cluster)
    rows: list[tuple[str, Any, str]] = [
        ("memory [GiB]", prediction.memory / 2**30, "MORE THAN THIS MACHINE HAS"),
        ("time here, if it fitted [s]", prediction.seconds, f"limited by: {prediction.limit}"),
        (
            "nodes",
            price.nodes,
            f"of {a['memory']:g} GiB, {100 * a['usable']:g} % of it usable (memory, usable)",
        ),
        ("bytes a particle", price.bytes_a_particle, "at the peak, halos not counted"),
        ("halo of a node [particles]", price.halo, "a cube of particles, all within its reach"),
        ("bytes exchanged a step", price.exchanged, "displacements out, forces back, a node"),
        (
            "step, computing [s]",
            price.computing,
            f"{a['cores']:g} cores like this machine's, {100 * a['efficiency']:g} % together, "
            f"{a['bandwidth']:g} GB/s (cores, efficiency, bandwidth)",
        ),
        (
            "step, exchanging [s]",
            price.exchanging,
            f"{a['network']:g} GB/s, {a['latency']:g} us a message (network, latency)",
        ),
        (
            "time there [s]",
            price.seconds,
            f"limited by: {price.limit}; the record at {a['storage']:g} GB/s (storage)",
        ),
    ]
    rows += [
        ("not in it", "", "building in parallel, and ghosts; what effects add to the stable step"),
        ("on paper", "", "solidsph runs on one machine; assumptions: --cluster NAME=VALUE"),
    ]
    return price, [{"quantity": name, "value": value, "why": why} for name, value, why in rows]


def work_done(work: Work, effort: Mapping[str, Any]) -> dict[str, Any]:
    """Counts of a run that is over: for an equilibrium by the iterations that it really took."""
    if work.statics is not None:
        done = effort["iterations"] + effort["load steps"]
        work = attrs.evolve(work, evaluations=done)
    return {"pair evaluations": work.pair_evaluations, "bytes touched": work.traffic}


def scored(prediction: Prediction | None, seconds: float, memory: int) -> dict[str, float]:
    """Prediction beside truth; nothing where there was none."""
    if prediction is None:
        return {}
    return {
        "predicted wall time [s]": prediction.run_seconds,
        "predicted over measured time [-]": prediction.run_seconds / max(seconds, 1e-9),
        "predicted peak memory [MiB]": prediction.memory / 2**20,
        "predicted over measured memory [-]": prediction.memory / memory,
    }


def compilations(prediction: Prediction | None) -> Collection[Compilation]:
    """What its run compiles."""
    return frozenset() if prediction is None else prediction.work.compilations


def scores(
    predictions: Mapping[str, Prediction | None], runs: Sequence[SceneRun]
) -> dict[str, float | None]:
    """Predicted seconds of each run of a case, by its name."""
    found = {run.name: predictions.get(run.name) for run in runs}
    return {name: None if one is None else one.run_seconds for name, one in found.items()}


def sums(
    runs: Sequence[SceneRun], predictions: Mapping[str, float | None]
) -> dict[str, float | None]:
    """Measured and predicted seconds of all runs of a case that finished."""
    done = [run for run in runs if run.outcome == "finished"]
    measured = sum(run.seconds for run in done)
    known = [predictions[run.name] for run in done]
    total = None if None in known else sum(one for one in known if one is not None)
    return {
        "wall time of finished runs [s]": measured,
        "predicted wall time [s]": total,
        "predicted over measured time [-]": None
        if total is None or not measured
        else total / measured,
    }
