"""Soundness: whether the energies of a motion add up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from solidsph.errors import DivergedError, RecordError, UnsoundError
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts
from solidsph.run.hooks import implementation
from solidsph.scene.scene_data import OFF

if TYPE_CHECKING:
    from solidsph.maths.arrays import Array
    from solidsph.model.particles import State
    from solidsph.run.built_scene import BuiltScene

_KEPT, _RISES = "soundness", "soundness rises"

# A quarter of the energy in play at the default tolerance, a hundredth: see `Soundness`.
_SWINGS = 25.0

# Of the energy in play: a run with such a residual has no energy that means anything.
_LOST = 1.0

# A residual is remembered with its time when it has grown by so much: few are, in any run.
_GROWTH = 1.02

# A deformed body may be stiffer than at rest: a margin of this much is none.
_MARGIN = 1.25

# Strains that rounding makes of the numbers that an engine adds up, in units of their precision.
_ROUNDED = 5e3

# A strain energy is a small difference of numbers near the modulus, in double precision: it is
# wrong by up to so much of the modulus. A hundred times that is below the default tolerance.
_CANCELLED = 100.0 * float(np.finfo(np.float64).eps)


class Soundness:
    """Hears every output of a motion, and judges its energy ledger.

    The largest energy residual is compared with the energy in play: the energy at the start and
    the work of every account by its amount, the most of it in the whole run. So what rounding or
    the first steps of a ramp leave of a tiny energy is of no consequence once there is more, and
    the judgement is one of the end. Only a run whose residual is larger than all energy in play,
    twice in succession and not falling, is stopped before: nothing is left in it to be wrong.

    A part of the residual comes and goes with the fastest vibrations: a leapfrog scheme keeps the
    energy less dt^2 / 8 times the sum of m a^2, and for linear forces keeps that exactly (Hairer,
    Lubich & Wanner 2003, the modified energy). It is no loss, and does not count as long as it is
    no larger than it is for the shortest waves of a lattice at half the CFL step, (omega dt)^2 / 4
    or a quarter; beyond that, something is faster than the step allows.
    """

    def __init__(self) -> None:
        self._accounts = Accounts()
        # Times [s], what is lost and the residual [J] there, each loss larger than all before.
        self._rises = np.empty((0, 3))
        self._first = np.nan  # what the step blurs of the energy at the start [J]
        self._part = 0.0  # at the last output: what is lost over the energy in play so far

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        self._accounts.add(observation)
        residual = self._accounts.residual
        swing = _swing(simulation, observation)
        self._first = swing if np.isnan(self._first) else self._first
        if residual < 0.0 and any(one.breaks_bonds for one in simulation.effects.values()):
            residual = 0.0  # neighbours that part take the energy between them away
        lost = min(abs(residual), max(abs(residual - swing + self._first), abs(residual) / _SWINGS))
        largest = self._rises[-1, 1] if len(self._rises) else 0.0
        if not lost <= _GROWTH * largest:
            rise = [[observation.state.time, lost, abs(residual)]]
            self._rises = np.append(self._rises, rise, axis=0)
        in_play = self._accounts.paid + rounding(simulation)
        before, self._part = self._part, lost / in_play
        if self._part >= before >= _LOST:
            self.judge(simulation)

    @implementation(tryfirst=True)  # what it cannot use is told before the record is taken over
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        if _KEPT in kept:
            self._accounts = Accounts.from_array(np.atleast_1d(kept[_KEPT])[:-1])
            self._first = float(kept[_KEPT][-1])
            self._rises = kept.get(_RISES, np.empty(0))
            if self._rises.ndim != 2 or self._rises.shape[1] != 3:
                raise RecordError(
                    "the checkpoint does not hold how the energy residual of its run rose; delete "
                    "it and resume again: the run is then carried out from its first state"
                )
        else:  # nobody judged until here
            self._accounts.add(observation)
            self._first = _swing(simulation, observation)

    @implementation
    def solidsph_keep(self, simulation: BuiltScene, kept: dict[str, Array]) -> None:
        kept[_KEPT] = np.append(self._accounts.to_array(), self._first)
        kept[_RISES] = self._rises

    def judge(self, simulation: BuiltScene) -> None:
        """Called at the end of the run.

        Raises:
            UnsoundError: the residual was larger than the scene's `energy_tolerance` allows.
        """
        found = self._found(simulation)
        if found is not None:
            raise found

    @implementation
    def solidsph_failure(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        found = self._found(simulation)
        if found is not None:
            error.cause += f" (before, from t = {found.time:.6g} s on, the energies did not add up)"
            error.remedy = f"{found.remedy}; likely cause: {found.cause}"

    def _found(self, simulation: BuiltScene) -> UnsoundError | None:
        tolerance = allowed(simulation)
        in_play = self._accounts.paid + rounding(simulation)
        parts = self._rises[:, 1] / in_play
        beyond = np.flatnonzero(~(parts <= tolerance))
        if not len(beyond):
            return None
        cause, remedy = _explained(simulation)
        return UnsoundError(
            time=float(self._rises[beyond[0], 0]),
            part=float(self._rises[:, 2].max()) / in_play,
            tolerance=tolerance,
            cause=cause,
            remedy=f"{remedy}; or, if the loss is meant, a larger energy_tolerance in the scene",
        )


def allowed(simulation: BuiltScene) -> float:
    """The energy residual over the energy in play that the scene tolerates."""
    wanted = simulation.scene.energy_tolerance
    return np.inf if wanted == OFF else float(wanted)


def _swing(simulation: BuiltScene, observation: Observation) -> float:
    """What comes and goes with the fastest vibrations: dt^2 / 8 times the sum of m a^2 [J]."""
    squares = np.einsum("ij,ij->i", *[observation.state.accelerations] * 2)
    return float(observation.masses @ squares) * simulation.step_size**2 / 8.0


def part_of_play(simulation: BuiltScene, accounts: Accounts) -> float:
    """The energy residual at the last output over the energy in play so far."""
    return abs(accounts.residual) / (accounts.paid + rounding(simulation))


def rounding(simulation: BuiltScene) -> float:
    """An energy below which everything is rounding [J]."""
    strain = _ROUNDED * simulation.dynamics.internal.precision
    return (strain**2 + _CANCELLED) * sum(
        float(body.masses.sum()) * body.material.wave_speed**2 for body in simulation.model.bodies
    )


def _explained(simulation: BuiltScene) -> tuple[str, str]:
    """The likely cause, and a remedy."""
    formulations = [body.formulation for body in simulation.model.bodies]
    for one in formulations:
        if one.configuration is Configuration.CURRENT:
            return (
                "the updated Lagrangian form, whose sums have no energy of their own and pull "
                "particles together under tension",
                "the total Lagrangian form",
            )
        if not one.divergence.adjoint:
            return (
                f"the divergence {type(one.divergence).__name__}, whose forces have no energy near "
                "a surface",
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
    if any(isinstance(body.material, HistoryMaterial) for body in simulation.model.bodies):
        return (
            "steps in which the material's history changes by much, or vibrations that they do "
            "not resolve",
            "half the time step",
        )
    controlled = any(load.stiffness_rate > 0.0 for load in simulation.dynamics.loads)
    if not controlled and any(one.gradient.exact_degree >= 1 for one in formulations):
        return (
            "vibrations that the step does not resolve, or motions that the gradient does not see",
            "half the time step, or the effect 'hourglass-control'",
        )
    return (
        "vibrations that the step does not resolve, or a part whose forces are not those of its "
        "energy (`solidsph check NAME`)",
        "half the time step",
    )
