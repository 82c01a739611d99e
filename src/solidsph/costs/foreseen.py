"""What a built scene takes: its counts priced, and what counts cannot price timed."""

from __future__ import annotations

from collections.abc import Collection

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.counted import counted
from solidsph.costs.model import Built, Prediction, predicted
from solidsph.costs.timed import timed
from solidsph.interfaces.plan import Compilation
from solidsph.simulation import Simulation


def foreseen(
    simulation: Simulation,
    machine: Calibration,
    *,
    built: Built | None = None,
    compiled: Collection[Compilation] = (),
) -> Prediction:
    """The prediction of `solidsph.costs.model` for a built scene.

    Parts of kinds that the model does not know are evaluated some times, which takes as long as
    some steps of the run.
    """
    work = counted(simulation)
    apart = timed(simulation, work)
    found = predicted(
        apart.rest(work, simulation),
        machine,
        built=built,
        compiled=compiled,
        besides=apart.seconds,
    )
    return attrs.evolve(found, work=work)
