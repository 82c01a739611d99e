"""Session: who hears a run, from its setup to its outcome."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from solidsph.errors import DivergedError, UnsoundError
from solidsph.resumption import Resumption

if TYPE_CHECKING:
    from solidsph.simulation import Simulation

FINISHED, INTERRUPTED = "finished", "interrupted"
"""Outcomes of a run that got to its end, and of one that somebody stopped."""

UNSOUND = "unsound"
"""How the outcome begins of a run that got to its end with energies that do not add up."""


def is_over(outcome: str) -> bool:
    """Whether a run with this outcome got to its end, sound or not."""
    return outcome == FINISHED or outcome.startswith(UNSOUND)


@contextmanager
def session(
    simulation: Simulation,
    record: Path | None,
    observers: Sequence[object],
    since: Resumption | None = None,
) -> Iterator[None]:
    """Within it, `observers` and a recorder hear the hooks of the simulation's manager.

    Setup is told on entry. On exit the outcome is told: "finished", or what went wrong.

    Args:
        simulation: what is carried out.
        record: HDF5 file to write, if one is wanted.
        observers: objects with methods of `solidsph.hooks.Moments`, heard in this session only.
        since: what is taken over from an earlier run that `record` holds.
    """
    heard = list(observers)
    if record is not None:
        from solidsph.results.checkpoint import checkpoint_path
        from solidsph.results.checkpointer import Checkpointer
        from solidsph.results.recorder import Recorder  # brings the file library with it

        # Carried out from the first state, a run has no use for a checkpoint of another.
        goes_on = since is not None and since.state is not None
        heard.append(Checkpointer(checkpoint_path(record), is_resumed=goes_on))
        heard.append(Recorder(record, since))
    for listener in heard:
        simulation.manager.register(listener)
    hook = simulation.manager.hook
    outcome = "stopped"
    try:
        hook.solidsph_setup(simulation=simulation)
        yield
        outcome = FINISHED
    except BaseException as cause:
        outcome = _told(cause)
        raise
    finally:
        hook.solidsph_finish(simulation=simulation, outcome=outcome)
        for listener in heard:
            simulation.manager.unregister(listener)


def _told(cause: BaseException) -> str:
    if isinstance(cause, KeyboardInterrupt):
        return INTERRUPTED
    kinds = {DivergedError: "diverged", UnsoundError: UNSOUND}
    kind = kinds.get(type(cause), type(cause).__name__)
    return f"{kind}: {cause}"
