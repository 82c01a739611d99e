"""Soundness: whether the energies of a motion add up."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solidsph.errors import DivergedError, RecordError, UnsoundError
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import implementation
from solidsph.scene.scene_data import OFF

_KEPT, _RISES = "soundness", "soundness rises"

# All of the energy in play at the default tolerance, a hundredth: see `Soundness`.
_SWINGS = 100.0

# Residual over the energy in play at which no energy of a run means anything.
_LOST = 1.0

# Growth of a residual from which it is kept with its time: so only few are kept in any run.
_GROWTH = 1.02

# Critical step over the step below which the step is suspected: a deformed body may be stiffer.
_MARGIN = 1.25

# Strains that rounding makes of the numbers that an engine adds up, in units of their precision.
_ROUNDED = 5e3

# A strain energy is a small difference of numbers near the modulus, in double precision: this is
# the share of the modulus by which it may be wrong. A hundred times it is below the default
# tolerance.
_CANCELLED = 100.0 * float(np.finfo(np.float64).eps)


class Soundness:
    """Observes every output of a motion, and judges its energy ledger.

    The largest energy residual is compared with the energy in play: the energy at the start plus
    the work of every account by its amount, the most in the whole run. So what rounding or the
    first steps of a ramp leave of a tiny energy does not matter once there is more, and the
    judgement comes at the end. A run is stopped earlier only if its residual is larger than all
    energy in play, twice in succession and not falling.

    A part of the residual comes and goes with the fastest vibrations: a leapfrog scheme keeps the
    energy less dt^2 / 8 times the sum of m a^2, and for linear forces keeps that exactly (Hairer,
    Lubich & Wanner 2003, the modified energy). It is no loss, and does not count as long as it is
    no larger than it is for the fastest vibrations at the critical step, (omega dt)^2 / 4 or all of
    the energy; beyond that, something is faster than the step allows.
    """

    def __init__(self) -> None:
        self._accounts = Accounts()
        # Times [s], losses and residuals [J] there; each loss is larger than all before.
        self._rises = np.empty((0, 3))
        self._first_swing = np.nan  # at the first output [J]
        self._swing, self._step = np.nan, np.nan  # at the last output [J], and its time step [s]
        self._share = 0.0  # at the last output: loss over the energy in play so far

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        self._accounts.add(observation)
        residual = self._accounts.residual
        swing = _swing(simulation, observation)
        if np.isnan(self._first_swing):
            self._first_swing = swing
        elif simulation.step_size != self._step:  # cut at the last output, and so is what swings
            self._first_swing -= self._swing * (1.0 - (simulation.step_size / self._step) ** 2)
        first, self._swing, self._step = self._first_swing, swing, simulation.step_size
        if residual < 0.0 and any(e.breaks_bonds for e in simulation.effects.values()):
            residual = 0.0  # bonds that fail take the energy between them away
        loss = min(abs(residual), max(abs(residual - swing + first), abs(residual) / _SWINGS))
        largest = self._rises[-1, 1] if len(self._rises) else 0.0
        if not loss <= _GROWTH * largest:
            rise = [[observation.state.time, loss, abs(residual)]]
            self._rises = np.append(self._rises, rise, axis=0)
        before, self._share = self._share, loss / self._in_play(simulation)
        if self._share >= before >= _LOST:
            self.judge(simulation)

    def _in_play(self, simulation: BuiltScene) -> float:
        return self._accounts.paid + rounding(simulation)

    @implementation(tryfirst=True)  # an unusable checkpoint is reported before the record changes
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        if _KEPT in kept:
            values = np.atleast_1d(kept[_KEPT])
            self._accounts = Accounts.from_array(values[:-3])
            self._first_swing, self._swing, self._step = (float(value) for value in values[-3:])
            self._rises = kept.get(_RISES, np.empty(0))
            if self._rises.ndim != 2 or self._rises.shape[1] != 3:
                raise RecordError(
                    "the checkpoint does not hold how the energy residual of its run rose; delete "
                    "it and resume again: the run then starts from its first state"
                )
        else:  # the earlier run was not judged
            self._accounts.add(observation)
            self._first_swing = self._swing = _swing(simulation, observation)
            self._step = simulation.step_size

    @implementation
    def solidsph_keep(self, kept: dict[str, Array]) -> None:
        swings = [self._first_swing, self._swing, self._step]
        kept[_KEPT] = np.append(self._accounts.to_array(), swings)
        kept[_RISES] = self._rises

    def judge(self, simulation: BuiltScene) -> None:
        """Judge the run at its end.

        Raises:
            UnsoundError: the residual was larger than the scene's `energy_tolerance` allows.
        """
        error = self._error(simulation)
        if error is not None:
            raise error

    @implementation
    def solidsph_failure(self, simulation: BuiltScene, error: DivergedError) -> None:
        before = self._error(simulation)
        if before is not None:
            error.cause += (
                f" (before, from t = {before.time:.6g} s on, the energies did not add up)"
            )
            error.remedy = f"{before.remedy}; likely cause: {before.cause}"

    def _error(self, simulation: BuiltScene) -> UnsoundError | None:
        allowed, in_play = tolerance(simulation), self._in_play(simulation)
        beyond = np.flatnonzero(~(self._rises[:, 1] / in_play <= allowed))
        if not len(beyond):
            return None
        cause, remedy = _explained(simulation)
        return UnsoundError(
            time=float(self._rises[beyond[0], 0]),
            part=float(self._rises[:, 2].max()) / in_play,
            tolerance=allowed,
            cause=cause,
            remedy=f"{remedy}; or, if the loss is meant, a larger energy_tolerance in the scene",
        )


def tolerance(simulation: BuiltScene) -> float:
    """Energy residual over the energy in play that the scene tolerates."""
    wanted = simulation.scene.energy_tolerance
    return np.inf if wanted == OFF else float(wanted)


def _swing(simulation: BuiltScene, observation: Observation) -> float:
    """Energy that comes and goes with the fastest vibrations: dt^2 / 8 times sum of m a^2 [J]."""
    squares = np.einsum("ij,ij->i", *[observation.state.accelerations] * 2)
    return float(observation.masses @ squares) * simulation.step_size**2 / 8.0


def residual_share(simulation: BuiltScene, accounts: Accounts) -> float:
    """Energy residual at the last output over the energy in play so far."""
    return abs(accounts.residual) / (accounts.paid + rounding(simulation))


def rounding(simulation: BuiltScene) -> float:
    """Energy below which everything is rounding [J]."""
    strain = _ROUNDED * simulation.dynamics.internal.precision
    return (strain**2 + _CANCELLED) * sum(
        float(body.masses.sum()) * body.material.wave_speed**2 for body in simulation.model.bodies
    )


def _explained(simulation: BuiltScene) -> tuple[str, str]:
    """The likely cause, and a remedy."""
    bodies = simulation.model.bodies
    for body in bodies:
        if body.formulation.configuration is Configuration.CURRENT:
            return (
                "the updated Lagrangian form, whose sums have no energy of their own and pull "
                "particles together under tension",
                "the total Lagrangian form",
            )
        if not body.formulation.divergence.adjoint:
            return (
                f"the divergence {type(body.formulation.divergence).__name__}, whose forces have "
                "no energy near a surface",
                "divergence = 'variational'",
            )
    from solidsph.statics.critical_step import critical_step  # only where it is asked for

    margin = critical_step(simulation).margin
    if margin < _MARGIN:
        return (
            f"the time step: the critical step of the undeformed scene is {margin:.4g} times that "
            "in use, and the fastest vibrations grow",
            f"a time_step_factor of {0.8 * margin * simulation.scene.time_step_factor:.2g}"
            if simulation.scene.time_step is None
            else f"a time_step of {0.8 * margin * simulation.step_size:.3g} s",
        )
    cause, remedy = "vibrations that the step does not resolve", "half the time step"
    if any(isinstance(body.material, HistoryMaterial) for body in bodies):
        return f"steps in which the material's history changes by much, or {cause}", remedy
    controlled = any(load.stiffness_rate > 0.0 for load in simulation.dynamics.loads)
    if not controlled and any(body.formulation.gradient.exact_degree >= 1 for body in bodies):
        return (
            f"{cause}, or motions that the gradient does not see",
            f"{remedy}, or the effect 'hourglass-control'",
        )
    return (
        f"{cause}, or a part whose forces are not those of its energy (`solidsph check NAME`)",
        remedy,
    )
