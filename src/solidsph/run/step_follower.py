"""StepFollower: looks whether the time step stays stable while bodies deform, and shortens it."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import TypeVar

import attrs
import numpy as np

from solidsph.errors import RecordError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import implementation
from solidsph.run.safe_step import safe_step

LOG = logging.getLogger(__name__)

S = TypeVar("S", bound=BuiltScene)

# Part of the safe step that the step must not exceed; or the part at the start, if that is larger.
# At sqrt(3) / 2 = 0.866 the fastest vibrations take three steps each, which makes even weakly
# nonlinear forces feed them: a block with random velocities of 2 % of the wave speed blew up at
# 0.86 after 1950 steps, and kept its energy within 1 % at 0.8.
_LIMIT = 0.85

# Growth of the largest strain, absolute and relative, after which the spectrum is looked at again:
# some thirty times until a body has been stretched to four times its length. In 2000 steps it may
# change without: a look takes six evaluations of the forces or a few more, less than 0.5 % of that.
_STRAIN, _RELATIVE = 0.1, 0.1
_MOST_STEPS = 2000

# Steps after which the strain is looked at where outputs are further apart; it takes about two.
_CHECKED = 250

# A step that is a thousandth of the first has not helped.
_MOST_CUTS = 10

# How often a stretch that fails is repeated, each time with half the step. A front that sharpens
# may stiffen a body between two looks: a sheet of rubber pulled by half its modulus lost three
# quarters of its critical step within 30 steps.
_MOST_REPEATS = 3

_KEPT, _MODE = "step follower", "step follower mode"


class StepFollower:
    """Compares the step with the safe step of the deformed bodies, in the course of a run.

    What it decides follows from the state and from what it keeps with it, so a run that is resumed
    takes the same steps.

    Attributes:
        cuts: what it has done, one line each.
    """

    def __init__(self, simulation: BuiltScene) -> None:
        self.cuts: list[str] = []
        safe = simulation.safe
        self._mode = None if safe is None else safe.mode
        self._allowed = _LIMIT
        if safe is not None:
            self._allowed = max(_LIMIT, simulation.step_size * 2**simulation.halvings / safe.step)
        self._time = simulation.initial.time  # of the last look [s]
        self._strain = 0.0  # the largest at the last look [-]
        self._failed_from, self._failures = -np.inf, 0  # where the last stretch that failed began

    @implementation(tryfirst=True)  # an unusable checkpoint is reported before the record changes
    def solidsph_resume(self, observation: Observation, kept: Mapping[str, Array]) -> None:
        if _KEPT not in kept or self._mode is None:
            return
        values, mode = np.atleast_1d(kept[_KEPT]), kept.get(_MODE, np.empty(0))
        if values.shape != (2,) or mode.shape != self._mode.shape:
            raise RecordError(
                "the checkpoint does not hold how its run followed the critical step; delete it "
                "and resume again: the run then starts from its first state"
            )
        self._time, self._strain = (float(value) for value in values)
        self._mode = mode

    @implementation
    def solidsph_keep(self, kept: dict[str, Array]) -> None:
        if self._mode is not None:
            kept[_KEPT], kept[_MODE] = np.array([self._time, self._strain]), self._mode

    def next_check(self, state: State, stop: int) -> int:
        """The step up to which a run may go on from `state` without a look, `stop` at most."""
        return stop if self._mode is None else min(stop, state.step + _CHECKED)

    def followed(self, simulation: S, state: State, observation: Observation) -> tuple[S, State]:
        """The scene and the state to go on with: the same, or those of a shorter step."""
        if self._mode is None or not self._is_due(simulation, state, observation):
            return simulation, state
        safe = safe_step(simulation.dynamics, simulation.integrator, state, near=self._mode)
        if safe is None:  # the steps that follow fail, and tell why
            return simulation, state
        self._time, self._mode, before = state.time, safe.mode, simulation
        while (
            simulation.step_size > self._allowed * safe.step
            and simulation.halvings < before.halvings + _MOST_CUTS
        ):
            simulation = simulation.halved()
        if simulation is before:
            return simulation, state
        self.cuts.append(
            f"the step was cut to {simulation.step_size:.6g} s at t = {state.time:.6g} s: the "
            f"critical step of the deformed bodies is {safe.step:.6g} s"
        )
        LOG.info(self.cuts[-1])
        return simulation, restarted(simulation, state, before.halvings)

    def repeated(self, simulation: S, state: State, cause: str) -> tuple[S, State] | None:
        """The scene and the state to go on with, in half the step, where steps from `state` on
        failed; None if that has not helped, or if the scene asks for a longer step than is safe."""
        self._failures = self._failures + 1 if state.time == self._failed_from else 1
        self._failed_from = state.time
        tried = self._failures > _MOST_REPEATS or simulation.halvings >= _MOST_CUTS
        if self._mode is None or self._allowed > _LIMIT or tried:
            return None
        shorter = simulation.halved()
        self.cuts.append(
            f"the step was cut to {shorter.step_size:.6g} s at t = {state.time:.6g} s: with a "
            f"longer one {cause}"
        )
        LOG.info(self.cuts[-1])
        return shorter, restarted(shorter, state, simulation.halvings)

    def _is_due(self, simulation: BuiltScene, state: State, observation: Observation) -> bool:
        strain = _largest_strain(observation)
        has_grown = strain > (1.0 + _RELATIVE) * self._strain + _STRAIN
        if has_grown:
            self._strain = strain
        return has_grown or state.time - self._time >= (_MOST_STEPS - 0.5) * simulation.step_size


def _largest_strain(observation: Observation) -> float:
    """Largest |tr(F^T F) - d| / 2 + |ln J|, which turning does not change [-]."""
    F, real = observation.deformation_gradients, ~observation.particles.ghosts
    with np.errstate(all="ignore"):
        strains = np.abs(0.5 * (np.einsum("nij,nij->n", F, F) - F.shape[1]))
        strains += np.abs(np.log(observation.volume_ratios))
    largest = float(strains.max(where=real, initial=0.0))
    return largest if np.isfinite(largest) else np.inf


def restarted(simulation: BuiltScene, state: State, halvings: int) -> State:
    """A state of the same scene, whose step was halved `halvings` times, to go on from here."""
    dynamics = simulation.dynamics
    moved = attrs.evolve(
        state,
        step=state.step * 2 ** (simulation.halvings - halvings),
        positions=dynamics.place(state.time, state.positions),
        velocities=dynamics.carry(state.time, state.velocities),
    )
    with np.errstate(all="ignore"):  # as in the steps that follow
        begun = simulation.integrator.start(moved, dynamics, simulation.step_size)
    return attrs.evolve(begun, work=dict(state.work))
