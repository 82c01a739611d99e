"""Session: who hears a run, from its setup to its outcome."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from solidsph.errors import DivergedError

if TYPE_CHECKING:
    from solidsph.simulation import Simulation


@contextmanager
def session(
    simulation: Simulation, record: Path | None, observers: Sequence[object]
) -> Iterator[None]:
    """Within it, `observers` and a recorder hear the hooks of the simulation's manager.

    Setup is told on entry. On exit the outcome is told: "finished", or what went wrong.

    Args:
        simulation: what is carried out.
        record: HDF5 file to write, if one is wanted.
        observers: objects with methods of `solidsph.hooks.Moments`, heard in this session only.
    """
    heard = list(observers)
    if record is not None:
        from solidsph.results.recorder import Recorder  # brings the file library with it

        heard.append(Recorder(record))
    for listener in heard:
        simulation.manager.register(listener)
    hook = simulation.manager.hook
    outcome = "stopped"
    try:
        hook.solidsph_setup(simulation=simulation)
        yield
        outcome = "finished"
    except BaseException as cause:
        kind = "diverged" if isinstance(cause, DivergedError) else type(cause).__name__
        outcome = f"{kind}: {cause}"
        raise
    finally:
        hook.solidsph_finish(simulation=simulation, outcome=outcome)
        for listener in heard:
            simulation.manager.unregister(listener)
