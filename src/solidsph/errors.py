"""Everything that solidsph raises on purpose, under one base class.

A message says what was wrong, the value, what was expected and what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solidsph.simulation import Result


class SolidsphError(Exception):
    """Base of every error that solidsph raises on purpose."""


class SceneError(SolidsphError):
    """What the user asked for cannot be understood: an unknown word, a bad value, bad TOML."""


class PluginError(SolidsphError):
    """A part that was asked for cannot be loaded, or does not keep its interface's promise."""


class RecordError(SolidsphError):
    """A result file is missing, is not ours, or cannot be read or written."""


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

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments do not survive the default pickling between processes.
        return _rebuild_diverged, (
            self.step,
            self.time,
            self.particle,
            self.volume_ratio,
            self.cause,
            self.remedy,
        )


def _rebuild_diverged(
    step: int, time: float, particle: int, volume_ratio: float, cause: str, remedy: str
) -> DivergedError:
    return DivergedError(
        step=step,
        time=time,
        particle=particle,
        volume_ratio=volume_ratio,
        cause=cause,
        remedy=remedy,
    )


class UnsoundError(SolidsphError):
    """The energies of a motion do not add up: its result is not to be used.

    Attributes:
        time: when it began [s].
        part: the largest energy residual over the energy in play [-].
        tolerance: the scene's `energy_tolerance` [-].
        cause: what is likely to have done it.
        remedy: what to try.
        result: what the run left behind all the same; None in another process.
    """

    def __init__(self, *, time: float, part: float, tolerance: float, cause: str, remedy: str):
        self.time = time
        self.part = part
        self.tolerance = tolerance
        self.cause = cause
        self.remedy = remedy
        self.result: Result | None = None
        super().__init__(
            f"the energies of the run do not add up: from t = {time:.6g} s on the energy residual "
            f"is beyond energy_tolerance = {tolerance:g} of the energy in play, and reaches "
            f"{part:.3g} of it; what was recorded stays readable. Likely cause: {cause}. Remedy: "
            f"{remedy}"
        )

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments do not survive the default pickling between processes.
        return _rebuild_unsound, (self.time, self.part, self.tolerance, self.cause, self.remedy)


def _rebuild_unsound(
    time: float, part: float, tolerance: float, cause: str, remedy: str
) -> UnsoundError:
    return UnsoundError(time=time, part=part, tolerance=tolerance, cause=cause, remedy=remedy)


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

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments do not survive the default pickling between processes.
        return _rebuild_unbalanced, (
            self.load_factor,
            self.tried,
            self.residual,
            self.particle,
            self.volume_ratio,
            self.cause,
            self.remedy,
        )


def _rebuild_unbalanced(
    load_factor: float,
    tried: float,
    residual: float,
    particle: int,
    volume_ratio: float,
    cause: str,
    remedy: str,
) -> ConvergenceError:
    return ConvergenceError(
        load_factor=load_factor,
        tried=tried,
        residual=residual,
        particle=particle,
        volume_ratio=volume_ratio,
        cause=cause,
        remedy=remedy,
    )
