"""Session: who hears a run, from its setup to its outcome."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from solidsph.errors import BusyError, DivergedError, UnsoundError
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
) -> Iterator[Mapping[str, float]]:
    """Within it, `observers` and a recorder hear the hooks of the simulation's manager.

    Setup is told on entry. On exit the outcome is told: "finished", or what went wrong. It gives
    what is recorded of the history last, which is empty without a record.

    Args:
        simulation: what is carried out.
        record: HDF5 file to write, if one is wanted.
        observers: objects with methods of `solidsph.hooks.Moments`, heard in this session only.
        since: what is taken over from an earlier run that `record` holds.

    Raises:
        BusyError: the simulation is being run already.
        RecordError: another run writes the record.
    """
    with ExitStack() as stack:
        stack.enter_context(_alone(simulation))
        if record is not None:
            from solidsph.results.sole_writer import sole_writer

            stack.enter_context(sole_writer(record))
        yield from _heard(simulation, record, observers, since)


def _heard(
    simulation: Simulation,
    record: Path | None,
    observers: Sequence[object],
    since: Resumption | None,
) -> Iterator[Mapping[str, float]]:
    heard = list(observers)
    final: Mapping[str, float] = {}
    if record is not None:
        from solidsph.results.checkpointer import Checkpointer
        from solidsph.results.recorder import Recorder  # brings the file library with it

        # Carried out from the first state, a run has no use for a checkpoint of another.
        goes_on = since is not None and since.state is not None
        heard.append(Checkpointer(record, is_resumed=goes_on))
        recorder = Recorder(record, since)
        heard.append(recorder)
        final = recorder.final
    manager, hook = simulation.manager, simulation.manager.hook
    outcome = "stopped"
    try:
        for listener in heard:
            manager.register(listener)
        hook.solidsph_setup(simulation=simulation)
        yield final
        outcome = FINISHED
    except BaseException as cause:
        outcome = _told(cause)
        raise
    finally:
        try:
            hook.solidsph_finish(simulation=simulation, outcome=outcome)
        finally:
            for listener in heard:
                if manager.is_registered(listener):
                    manager.unregister(listener)


@contextmanager
def _alone(simulation: Simulation) -> Iterator[None]:
    """Within it, nobody else runs the simulation: its listeners, and what parts reuse from step to
    step, serve one run at a time."""
    key = id(simulation.dynamics)  # which the same simulation with more steps shares
    with _changing:
        if key in _running:
            raise BusyError(
                "this simulation is being run already, in another thread or by one of its own "
                "listeners; build the scene once for each run"
            )
        _running.add(key)
    try:
        yield
    finally:
        with _changing:
            _running.discard(key)


_running: set[int] = set()  # simulations, by their dynamics
_changing = Lock()


def _told(cause: BaseException) -> str:
    if isinstance(cause, KeyboardInterrupt):
        return INTERRUPTED
    kinds = {DivergedError: "diverged", UnsoundError: UNSOUND}
    kind = kinds.get(type(cause), type(cause).__name__)
    return f"{kind}: {cause}"
