"""Session: registration of the listeners of a run, from its setup to its outcome."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import Lock

from solidsph.errors import BusyError, DivergedError, UnsoundError
from solidsph.run.built_scene import BuiltScene
from solidsph.run.outcome import FINISHED, INTERRUPTED, UNSOUND

LOG = logging.getLogger(__name__)


@contextmanager
def session(simulation: BuiltScene, listeners: Sequence[object]) -> Iterator[None]:
    """Register `listeners` with the hooks of a simulation for the duration of a run.

    The setup hook is called on entry, the finish hook with the outcome on exit.

    Args:
        simulation: the simulation that runs.
        listeners: objects with methods of `solidsph.run.hooks.Hooks`.
    """
    manager, hook = simulation.manager, simulation.manager.hook
    outcome = "stopped"
    try:
        for listener in listeners:
            manager.register(listener)
        hook.solidsph_setup(simulation=simulation)
        LOG.info("the run begins: %r", simulation)
        yield
        outcome = FINISHED
    except BaseException as cause:
        outcome = _outcome(cause)
        raise
    finally:
        LOG.info("the run has ended: %s", outcome)
        try:
            hook.solidsph_finish(simulation=simulation, outcome=outcome)
        finally:
            for listener in listeners:
                if manager.is_registered(listener):
                    manager.unregister(listener)


@contextmanager
def exclusive(simulation: BuiltScene) -> Iterator[None]:
    """Exclude other runs of a simulation, whose listeners and buffers serve one run at a time.

    Raises:
        BusyError: the simulation is running already.
    """
    key = id(simulation.dynamics)  # shared with copies that run longer
    with _changing:
        if key in _running:
            raise BusyError(
                "this simulation is running already, in another thread or in one of its own "
                "listeners; build the scene once per run"
            )
        _running.add(key)
    try:
        yield
    finally:
        with _changing:
            _running.discard(key)


_running: set[int] = set()  # ids of the dynamics of running simulations
_changing = Lock()


def _outcome(cause: BaseException) -> str:
    if isinstance(cause, KeyboardInterrupt):
        return INTERRUPTED
    kinds = {DivergedError: "diverged", UnsoundError: UNSOUND}
    kind = kinds.get(type(cause), type(cause).__name__)
    return f"{kind}: {cause}"
