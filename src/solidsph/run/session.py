"""Session: who hears a run, from its setup to its outcome."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import Lock

from solidsph.errors import BusyError, DivergedError, UnsoundError
from solidsph.run.built_scene import BuiltScene
from solidsph.run.outcome import FINISHED, INTERRUPTED, UNSOUND


@contextmanager
def session(simulation: BuiltScene, listeners: Sequence[object]) -> Iterator[None]:
    """Within it, `listeners` hear the hooks of the simulation's manager.

    Setup is told on entry. On exit the outcome is told: "finished", or what went wrong.

    Args:
        simulation: what is run.
        listeners: objects with methods of `solidsph.run.hooks.Hooks`, heard in this session only.
    """
    manager, hook = simulation.manager, simulation.manager.hook
    outcome = "stopped"
    try:
        for listener in listeners:
            manager.register(listener)
        hook.solidsph_setup(simulation=simulation)
        yield
        outcome = FINISHED
    except BaseException as cause:
        outcome = _told(cause)
        raise
    finally:
        try:
            hook.solidsph_finish(simulation=simulation, outcome=outcome)
        finally:
            for listener in listeners:
                if manager.is_registered(listener):
                    manager.unregister(listener)


@contextmanager
def alone(simulation: BuiltScene) -> Iterator[None]:
    """Within it, nobody else runs the simulation: its listeners, and what parts reuse from step to
    step, serve one run at a time.

    Raises:
        BusyError: the simulation is being run already.
    """
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
