"""Loads whose forces are among the internal forces, as they share the passes of these.

The loop has no account of such forces. What they are at the end of a stretch of steps, and what
work they did in it, is found afterwards: exactly as the trapezoidal rule, step by step, has it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np

from solidsph.engines.compiled.hourglass_sweeps import HourglassSweeps, compiled_sweeps
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.engines.compiled.time_loop.penalised import (
    PenalisedBody,
    penalised_data,
    penalised_forces,
)
from solidsph.engines.compiled.time_loop.rated import RatedBody, rated_data, rated_forces
from solidsph.interfaces.compilable_terms import HourglassLoad, RateStressLoad
from solidsph.interfaces.terms import Load, StressTerm
from solidsph.maths.arrays import Array

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody


class MergedLoad(ABC):
    """A load among the internal forces of all bodies."""

    load: Load
    functions: tuple[Any, ...]  # of each body: compiled (data, u (n, d), v (n, d), total (n, d))
    data: tuple[Any, ...]
    apply: Any  # compiled (load, step, u, v, path, total), called after the internal forces

    @abstractmethod
    def begin(self, u: Array) -> None:
        """Prepare for a stretch of steps from displacements u (n, d) [m]."""

    @abstractmethod
    def settle(self, before: Array, u_before: Array, u: Array) -> tuple[Array, float]:
        """Forces (n, d) [N] at the end of a stretch, and their work in it [J].

        Args:
            before: forces at its start, (n, d) [N].
            u_before: displacements at its start, (n, d) [m].
            u: displacements at its end, (n, d) [m].
        """


def merged_load(
    loads: Sequence[Load],
    parts: Sequence[ReferenceBody],
    conditions: Sequence[StressTerm],
    step: float,
) -> MergedLoad | None:
    """The first load that can be merged, in steps of `step` [s]; others have their own passes."""
    if conditions or not all(part.fused and not part.filters for part in parts):
        return None
    double = all(part.u.dtype == np.float64 for part in parts)
    for load in loads:
        with suppress(NotCompilableError):
            if isinstance(load, HourglassLoad) and double:
                return MergedPenalty.of(load, parts, step)
            if isinstance(load, RateStressLoad):
                return MergedRate.of(load, parts, step)
    return None


@final
@attrs.frozen(eq=False)
class MergedPenalty(MergedLoad):
    """Forces -K u of the hourglass energy, whose work is the energy lost, whatever the path."""

    load: HourglassLoad
    functions: tuple[Any, ...]
    data: tuple[PenalisedBody, ...]
    sweeps: Sequence[HourglassSweeps]

    @classmethod
    def of(cls, load: HourglassLoad, parts: Sequence[ReferenceBody], step: float) -> MergedPenalty:
        """The load, merged with the forces of these bodies."""
        sweeps = compiled_sweeps(load.operators)
        data = [
            penalised_data(part, sweep.pairs, step)
            for part, sweep in zip(parts, sweeps, strict=True)
        ]
        return cls(load, tuple(map(penalised_forces, parts)), tuple(data), sweeps)

    @property
    def apply(self) -> Any:
        return _nothing

    def begin(self, u: Array) -> None:
        pass

    def settle(self, before: Array, u_before: Array, u: Array) -> tuple[Array, float]:
        forces = np.concatenate([own.forces(u[own.pairs.body.extent]) for own in self.sweeps])
        return forces, 0.5 * float(np.sum(forces * u) - np.sum(before * u_before))


@final
@attrs.frozen(eq=False)
class MergedRate(MergedLoad):
    """Forces of a stress by the rate. The passes sum the work of the stress along H, all but that
    of the forces at the start of a stretch, of which there are no stresses."""

    load: RateStressLoad
    functions: tuple[Any, ...]
    data: tuple[RatedBody, ...]
    parts: Sequence[ReferenceBody]

    @classmethod
    def of(cls, load: RateStressLoad, parts: Sequence[ReferenceBody], step: float) -> MergedRate:
        """The load, merged with the forces of these bodies.

        Raises:
            NotCompilableError: its formula does not compile.
        """
        functions = tuple(rated_forces(part, load) for part in parts)
        data = tuple(rated_data(part, load, step) for part in parts)
        return cls(load, functions, data, parts)

    @property
    def apply(self) -> Any:
        return _work_of_first(self.load.reference.shape[1])

    def begin(self, u: Array) -> None:
        for part, own in zip(self.parts, self.data, strict=True):
            own.works[:] = 0.0
            own.stress[:] = 0.0
            part.gradient_of(u[part.body.extent], own.gradients.transpose(2, 0, 1))

    def settle(self, before: Array, u_before: Array, u: Array) -> tuple[Array, float]:
        forces = np.zeros_like(u)
        for part, own in zip(self.parts, self.data, strict=True):
            part.spread(own.stress, forces[part.body.extent])
        return forces, float(sum(own.works.sum() for own in self.data))


@njit
def _nothing(load, step, u, v, path, total):
    pass


@cache
def _work_of_first(dimension: int) -> Any:
    """The forces at the start of a stretch along half of its first step."""

    @njit
    def apply(load, step, u, v, path, total):
        if step == 0:
            for p in range(len(path)):
                for i in range(dimension):
                    load.work[0] += 0.5 * load.before[p, i] * path[p, i]

    return apply
