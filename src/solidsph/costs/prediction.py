"""Prediction of the time and memory of a built scene."""

from __future__ import annotations

from collections.abc import Collection

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.count import count_work
from solidsph.costs.model import Built, Prediction, predict
from solidsph.costs.timing import time_uncounted
from solidsph.interfaces.plan import Compilation
from solidsph.simulation import Simulation


def predict_run(
    simulation: Simulation,
    machine: Calibration,
    *,
    built: Built | None = None,
    compiled: Collection[Compilation] = (),
) -> Prediction:
    """Predict a run of a built scene by the cost model.

    Parts of kinds that the model does not know are evaluated a few times and timed.
    """
    work = count_work(simulation)
    timings = time_uncounted(simulation, work)
    prediction = predict(
        timings.without_timed(work, simulation),
        machine,
        built=built,
        compiled=compiled,
        extra=timings.seconds,
    )
    return attrs.evolve(prediction, work=work)
