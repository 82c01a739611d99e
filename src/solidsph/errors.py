"""Everything that solidsph raises on purpose, under one base class.

A message says what was wrong, the value, what was expected and what to do.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from typing import Any


class PortableError(Exception):
    """Survives pickling, as between processes, with its message, attributes, notes and cause."""

    def __reduce__(self) -> tuple[object, ...]:
        # Not by a call of the class with `args`, as exceptions do by default: what a class takes
        # is often not what it hands on to them.
        context = None if self.__suppress_context__ else self.__context__
        return _restored, (
            type(self),
            self.args,
            dict(self.__dict__),
            _portable(self.__cause__),
            _portable(context),
            self.__suppress_context__,
        )


def _restored(
    kind: type[PortableError],
    args: tuple[object, ...],
    attributes: Mapping[str, Any],
    cause: BaseException | None,
    context: BaseException | None,
    is_context_hidden: bool,
) -> PortableError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    error.__cause__, error.__context__ = cause, context
    error.__suppress_context__ = is_context_hidden
    return error


def _portable(error: BaseException | None) -> BaseException | None:
    """The error, or what it says if it cannot be pickled or not be read again."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # whatever the error of another library does when it is made anew
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


class SolidsphError(PortableError):
    """Base of every error that solidsph raises on purpose."""


class SceneError(SolidsphError):
    """What the user asked for cannot be understood: an unknown word, a bad value, bad TOML."""


class PluginError(SolidsphError):
    """A part that was asked for cannot be loaded, or does not keep its interface's promise."""


class RecordError(SolidsphError):
    """A result file is missing, is not ours, or cannot be read or written."""


class BusyError(SolidsphError):
    """What was asked for is in use: a simulation that is being run already."""


class ForkError(SolidsphError):
    """This process is the fork of one that had started threads, which do not live on in it."""


class BuildError(SolidsphError):
    """Parts that do not fit each other. `problems` holds every one found, each with its remedy."""

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        count = len(self.problems)
        head = "the simulation cannot be built" + (f", {count} problems:" if count > 1 else ":")
        super().__init__("\n  - ".join([head, *self.problems]))


class DivergedError(SolidsphError):
    """A run went wrong: where, when, and the local volume ratio there.

    Listeners of `solidsph_failure` may say more of cause and remedy.
    """

    def __init__(
        self,
        *,
        step: int,
        time: float,
        particle: int,
        volume_ratio: float,
        cause: str,
        remedy: str = "a smaller time_step_factor, a smoother load, or the total Lagrangian form",
    ):
        self.step = step
        self.time = time
        self.particle = particle
        self.volume_ratio = volume_ratio
        self.cause = cause
        self.remedy = remedy
        super().__init__()

    def __str__(self) -> str:
        return (
            f"the run diverged at step {self.step}, t = {self.time:.6g} s: {self.cause} at "
            f"particle {self.particle}, where J = {self.volume_ratio:.6g}; the record holds "
            f"everything up to there. Try {self.remedy}"
        )


class UnsoundError(SolidsphError):
    """The energies of a motion do not add up: its result is not to be used.

    Attributes:
        time: when it began [s].
        part: the largest energy residual over the energy in play [-].
        tolerance: the scene's `energy_tolerance` [-].
        cause: what is likely to have done it.
        remedy: what to try.
        result: the `Result` that the run left behind all the same; None in another process.
    """

    def __init__(self, *, time: float, part: float, tolerance: float, cause: str, remedy: str):
        self.time = time
        self.part = part
        self.tolerance = tolerance
        self.cause = cause
        self.remedy = remedy
        self.result: Any = None
        super().__init__(
            f"the energies of the run do not add up: from t = {time:.6g} s on the energy residual "
            f"is beyond energy_tolerance = {tolerance:g} of the energy in play, and reaches "
            f"{part:.3g} of it; what was recorded stays readable. Likely cause: {cause}. Remedy: "
            f"{remedy}"
        )


class ConvergenceError(SolidsphError):
    """No equilibrium was found: at which load, how far from balance, and where."""

    def __init__(
        self,
        *,
        load_factor: float,
        tried: float,
        residual: float,
        particle: int,
        volume_ratio: float,
        cause: str,
        remedy: str,
    ):
        self.load_factor = load_factor  # the last at which there was an equilibrium
        self.tried = tried  # the next, at which none was found
        self.residual = residual
        self.particle = particle
        self.volume_ratio = volume_ratio
        self.cause = cause
        self.remedy = remedy
        super().__init__(
            f"no equilibrium beyond load factor {load_factor:.6g}: {cause} at {tried:.6g}; the "
            f"forces miss balance by {residual:.3g} of what is applied, most at particle "
            f"{particle}, where J = {volume_ratio:.6g}. Remedy: {remedy}"
        )


class PartWarning(PortableError, UserWarning):  # noqa: N818 (a warning, no error)
    """A part does not keep a promise of its interface."""
