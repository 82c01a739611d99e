"""Accounts of loads and constraints: between arrays of the compiled loop and those of a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.engines.compiled.time_loop.constraints import (
    FollowingGhosts,
    ScheduledMotion,
    constraint_data,
)
from solidsph.engines.compiled.time_loop.loads import LoadData
from solidsph.engines.compiled.time_loop.merged import MergedLoad
from solidsph.interfaces.compilable_terms import ScheduledConstraint
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.terms import GhostConstraint
from solidsph.maths.arrays import Array
from solidsph.model.particles import State


@final
@attrs.define(eq=False)
class Accounts:
    """Forces and work of every load and constraint."""

    sums: InternalForces
    equation: EquationOfMotion
    work: dict[str, float]  # by account [J]
    load_forces: list[Array]  # (k, d) of each load, on its particles [N]
    reactions: list[Array]  # (m,) of each constraint [N]; empty for ghosts that follow

    @classmethod
    def of(cls, sums: InternalForces, equation: EquationOfMotion, state: State) -> Accounts:
        """The accounts of a state."""
        u = state.positions - equation.particles.positions
        loads = [state.applied[load.label][load.particles] for load in equation.loads]
        # An account also holds the forces that ghosts of the same handler return.
        handed = _handed_on(sums, equation, state.time, u, loads)
        reactions = [
            (state.applied[motion.label] - handed.get(motion.label, 0.0))[motion.entries]
            if isinstance(motion, ScheduledConstraint)
            else np.empty(0)
            for motion in equation.constraints
        ]
        return cls(sums, equation, dict(state.work), loads, reactions)

    def loads(self, own: Sequence[Any], threads: int) -> tuple[LoadData, ...]:
        """The data of the loads, with the `own` data of each."""
        each = zip(self.equation.loads, self.load_forces, own, strict=True)
        return tuple(
            LoadData(load.particles, before, np.zeros(threads), one) for load, before, one in each
        )

    def motions(self, times: Array) -> tuple[ScheduledMotion | FollowingGhosts, ...]:
        """The data of the constraints."""
        pairs = zip(self.equation.constraints, self.reactions, strict=True)
        return tuple(
            constraint_data(motion, times, before, self.equation.step_size)
            for motion, before in pairs
        )

    def settle(
        self, loads: Sequence[LoadData], motions: Sequence[ScheduledMotion | FollowingGhosts]
    ) -> None:
        """Add the work done in the loop; it has updated the forces in place."""
        conditions = (*self.equation.loads, *self.equation.constraints)
        for condition, part in zip(conditions, (*loads, *motions), strict=True):
            self.work[condition.label] += float(part.work.sum())

    def settle_merged(self, merged: Sequence[MergedLoad], before: Array, now: Array) -> None:
        """Add forces and work of loads of which the loop has no account, from displacements
        `before` to those of `now`, (n, d) [m]."""
        for one in merged:
            k = self.equation.loads.index(one.load)
            self.load_forces[k], work = one.settle(self.load_forces[k], before, now)
            self.work[one.load.label] += work

    def applied(self, time: float, u: Array) -> Mapping[str, Array]:
        """Force of every account on every particle, (n, d) [N], at displacements u (n, d) [m]."""
        equation = self.equation
        applied = {c.label: np.zeros_like(u) for c in (*equation.loads, *equation.constraints)}
        for load, force in zip(equation.loads, self.load_forces, strict=True):
            applied[load.label][load.particles] += force
        for motion, reaction in zip(equation.constraints, self.reactions, strict=True):
            if isinstance(motion, ScheduledConstraint):
                applied[motion.label][motion.entries] += reaction
        for label, force in _handed_on(self.sums, equation, time, u, self.load_forces).items():
            applied[label] += force
        return applied


def _handed_on(
    sums: InternalForces,
    equation: EquationOfMotion,
    time: float,
    u: Array,
    load_forces: Sequence[Array],
) -> Mapping[str, Array]:
    """Forces that ghosts return to the particles they follow, (n, d) [N] by account."""
    extensions = [c for c in equation.constraints if isinstance(c, GhostConstraint)]
    if not extensions:
        return {}
    with np.errstate(all="ignore"):
        total = sums.forces(time, u)
    for load, force in zip(equation.loads, load_forces, strict=True):
        total[load.particles] += force
    handed = {c.label: np.zeros_like(u) for c in extensions}
    for extension in extensions:
        before = total.copy()
        extension.return_forces(total)
        handed[extension.label] += total - before
    return handed
