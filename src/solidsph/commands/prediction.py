"""Predictions of time and memory as the verbs show them, before a run and compared with it."""

from __future__ import annotations

import logging
import subprocess
import time as clock
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import attrs

from solidsph.costs import calibration
from solidsph.costs.calibration import Calibration
from solidsph.costs.cluster import Cluster, estimate_on_cluster
from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.model import Built, Prediction
from solidsph.costs.prediction import predict_run
from solidsph.costs.process import excess_load, machine_memory, memory_now, peak_memory
from solidsph.costs.work import Work
from solidsph.interfaces.plan import Compilation
from solidsph.run.outcome import FINISHED
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case_run import SceneRun

LOG = logging.getLogger(__name__)

LONG = 5.0
"""Runs predicted to take longer are announced [s]."""

INTERNALS = frozenset(
    {
        *("engine", "time loop", "pairs an evaluation visits", "entries of the factors"),
        *("bytes an evaluation touches", "bytes touched in all", "bytes held", "bytes touched"),
    }
)
"""Quantities that tables show with --verbose only."""

# For runs predicted to be shorter, this machine is not calibrated [s].
_SHORT = 2.0

Row = dict[str, Any]


def rows(*entries: tuple[str, Any, str]) -> list[Row]:
    """Rows of a table of quantity, value and why."""
    return [{"quantity": name, "value": value, "why": why} for name, value, why in entries]


def build_timed(scene: Scene) -> tuple[Simulation, Built]:
    """A built scene, with the time and memory of the build."""
    begun = clock.perf_counter()
    simulation = Simulation.builder(scene).build()
    seconds = clock.perf_counter() - begun
    return simulation, Built(seconds, peak_memory(), memory_now())


def this_machine() -> Calibration:
    """Calibration of this machine, or of the reference machine if it cannot be measured."""
    try:
        return calibration.this_machine()
    except (OSError, ValueError, subprocess.SubprocessError) as cause:
        LOG.warning("this machine could not be calibrated (%s): a reference is used", cause)
        return REFERENCE


def try_prediction(
    simulation: Simulation, build: Built | None, compiled: Collection[Compilation] = ()
) -> Prediction | None:
    """Time and memory of a run; None if they cannot be predicted, which must not end the run.

    The machine is calibrated only for runs that are long enough.
    """
    try:
        estimate = predict_run(simulation, REFERENCE, built=build, compiled=compiled)
        known = calibration.cached_calibration()
        if known is None and estimate.run_seconds < _SHORT:
            return estimate
        return predict_run(simulation, known or this_machine(), built=build, compiled=compiled)
    except Exception:
        return None


def announcement(prediction: Prediction | None) -> str:
    """One line before a long run; empty before a short one."""
    if prediction is None or prediction.seconds <= LONG:
        return ""
    parts = ", ".join(f"{name} {seconds:.2g}" for name, seconds in prediction.parts.items())
    return (
        f"predicted: {prediction.seconds:.3g} s ({parts}), "
        f"{prediction.memory / 2**20:.0f} MiB at the peak"
    )


def work_rows(work: Work) -> list[Row]:
    """Work of a run, the same on every machine."""
    how = "counted" if work.counted else "estimated from volumes and the support, nothing is built"
    calls = "one a step, and one at the start"
    if work.statics is not None:
        calls = "one an iteration and one a load step, at least"
    counts = rows(
        ("pairs", work.pairs, f"ordered pairs of neighbours, self pairs included; {how}"),
        ("pairs an evaluation visits", work.visited, "with those of loads and effects"),
        ("evaluations of the forces", work.evaluations, calls),
        ("pair evaluations", work.pair_evaluations, "visited pairs times evaluations"),
        ("bytes an evaluation touches", work.touched, "at least once, whatever the caches are"),
        ("bytes touched in all", work.traffic, "times evaluations"),
        ("bytes held", work.held, "in arrays kept between evaluations"),
        ("outputs", work.outputs, "observed states, the first one included"),
        ("record [MiB]", work.record_bytes / 2**20, "position, velocity, stress, volume ratio"),
    )
    if work.statics is None:
        return counts
    solver = (
        ("products with the tangent", work.statics.products, "of conjugate gradients, a guess")
        if work.statics.products
        else ("entries of the factors", work.statics.fill, "estimated for the body's box")
    )
    return counts + rows(
        ("iterations", work.statics.iterations, "of Newton's method, a guess"), solver
    )


def prediction_rows(prediction: Prediction) -> list[Row]:
    """Predicted time and memory on this machine."""
    build = "measured just now" if prediction.measured_build else "predicted"
    reasons = {
        "build": f"{build}: particles, neighbours, operators",
        "compile": "once a process for every kind of part",
        "steps": "work above times the measured speed of this machine",
        "outputs": "observing, and writing the record",
    }
    limit, busy = f"limited by: {prediction.limit}", excess_load()
    if busy >= 0.5:
        limit += f"; {busy:.1f} other programs want a core: it takes longer"
    return rows(
        ("predicted wall time [s]", prediction.seconds, limit),
        *(
            (
                f"  {name} [s]",
                seconds,
                f"{100 * seconds / prediction.seconds:.0f} %, {reasons[name]}",
            )
            for name, seconds in prediction.parts.items()
        ),
        (
            "predicted peak memory [MiB]",
            prediction.memory / 2**20,
            f"of {machine_memory() / 2**30:.3g} GiB that this machine has",
        ),
    )


def cluster_rows(prediction: Prediction, machine: Calibration, cluster: Cluster) -> list[Row]:
    """Estimate for a scene larger than this machine, on an assumed cluster."""
    price = estimate_on_cluster(prediction, machine, cluster)
    a = attrs.asdict(cluster)
    return rows(
        ("memory [GiB]", prediction.memory / 2**30, "MORE THAN THIS MACHINE HAS"),
        ("time here, if it fitted [s]", prediction.seconds, f"limited by: {prediction.limit}"),
        (
            "nodes",
            price.nodes,
            f"of {a['memory']:g} GiB, {100 * a['usable']:g} % of it usable (memory, usable)",
        ),
        ("bytes a particle", price.bytes_a_particle, "at the peak, without halos"),
        ("halo of a node [particles]", price.halo, "a cube of particles, all within its reach"),
        ("bytes exchanged a step", price.exchanged, "displacements out, forces back, per node"),
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
        ("not in it", "", "building in parallel, and ghosts; what effects add to the stable step"),
        ("on paper", "", "solidsph runs on one machine; assumptions: --cluster NAME=VALUE"),
    )


def work_done(prediction: Prediction | None, effort: Mapping[str, Any]) -> dict[str, Any]:
    """Counts of a finished run; of an equilibrium by the iterations that it took."""
    if prediction is None:
        return {}
    work = prediction.work
    if work.statics is not None:
        work = attrs.evolve(work, evaluations=effort["iterations"] + effort["load steps"])
    return {"pair evaluations": work.pair_evaluations, "bytes touched": work.traffic}


def comparison(prediction: Prediction | None, seconds: float, memory: int) -> dict[str, float]:
    """Prediction beside measured seconds and bytes; empty without a prediction."""
    if prediction is None:
        return {}
    return {
        "predicted wall time [s]": prediction.run_seconds,
        "predicted over measured time [-]": prediction.run_seconds / max(seconds, 1e-9),
        "predicted peak memory [MiB]": prediction.memory / 2**20,
        "predicted over measured memory [-]": prediction.memory / memory,
    }


def total_comparison(
    runs: Sequence[SceneRun], predicted: Mapping[str, float | None]
) -> dict[str, float | None]:
    """Measured and predicted seconds of all finished runs of a case, predicted ones by name."""
    finished = [run for run in runs if run.outcome == FINISHED]
    measured = sum(run.seconds for run in finished)
    known = [seconds for run in finished if (seconds := predicted[run.name]) is not None]
    total = sum(known) if len(known) == len(finished) else None
    return {
        "wall time of finished runs [s]": measured,
        "predicted wall time [s]": total,
        "predicted over measured time [-]": total / measured if total and measured else None,
    }
