"""Carrying out a scene: as a motion in time, or as an equilibrium, whichever it asks for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from solidsph.resumption import Resumption
from solidsph.simulation import Result, Simulation


def carry_out(
    simulation: Simulation,
    *,
    record: Path | str | None = None,
    observers: Sequence[object] = (),
    since: Resumption | None = None,
) -> Result:
    """Find the equilibrium if the scene has [statics], follow the motion if not.

    Args:
        simulation: a built scene.
        record: HDF5 file to write; the folder is made if it is missing.
        observers: objects with methods of `solidsph.hooks.Moments`, heard in this run only.
        since: what is taken over from an earlier run that `record` holds; see `solidsph.resume`.

    Raises:
        DivergedError: the motion went wrong.
        ConvergenceError: no equilibrium was found.
    """
    if simulation.scene.statics is None:
        return simulation.run(record=record, observers=observers, since=since)
    from solidsph.statics.run import run_statics  # brings the sparse solvers with it

    wanted = simulation.scene.statics
    return run_statics(simulation, wanted, record=record, observers=observers, since=since)
