"""Conditions on some of the particles alone, cut out of conditions on all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.compilable_terms import (
    HourglassLoad,
    PairLoad,
    PairTable,
    PointwiseLoad,
    ScheduledConstraint,
    ScheduledLoad,
)
from solidsph.interfaces.hourglass_energy import HourglassOperator
from solidsph.interfaces.terms import Load, Observation, Term
from solidsph.maths.arrays import Array, Indices, Mask

ASLEEP = "asleep"
"""Account of what holds particles that sleep; it does no work, and is told to nobody."""


_KINDS = (ScheduledConstraint, ScheduledLoad, PointwiseLoad, PairLoad, HourglassLoad)


def check_restrictable(condition: Term) -> None:
    """Raise SceneError unless a condition can act on some of the particles alone."""
    if not isinstance(condition, _KINDS):
        raise SceneError(
            f"sleep: {condition.label!r} does not say what it depends on particle by particle, so "
            "that it cannot act on those alone that are awake; leave out it, or [sleep]"
        )


@attrs.frozen(eq=False)
class Chosen:
    """Some of the particles, numbered anew."""

    particles: Indices  # (k,) in rising order
    places: Indices  # (n,) their new numbers, -1 of all others

    @classmethod
    def of(cls, particles: Indices, count: int) -> Chosen:
        places = np.full(count, -1, dtype=np.intp)
        places[particles] = np.arange(len(particles))
        return cls(particles, places)

    def motion(self, whole: ScheduledConstraint, held: Mask) -> ScheduledConstraint:
        """The motion of those of the chosen that are not `held` (n,) as they are."""
        particles, axes = whole.entries
        kept = np.flatnonzero((self.places[particles] >= 0) & ~held[particles])
        shape = (len(self.particles), whole.shape[1])
        return _Motion(whole, kept, (self.places[particles[kept]], axes[kept]), shape)

    def load(self, whole: Load) -> Load:
        """The load on the chosen."""
        kept = np.flatnonzero(self.places[whole.particles] >= 0)
        own = self.places[whole.particles[kept]]
        match whole:
            case ScheduledLoad():
                return _Scheduled(whole, kept, own)
            case PointwiseLoad():
                return _Pointwise(whole.label, own, whole.values[kept], whole.force)
            case HourglassLoad():
                operators = [one.part(self.particles) for one in whole.operators]
                return _Hourglass(whole.label, whole.reference[self.particles], operators)
            case PairLoad():
                return _Paired(whole.label, self._pairs(whole.pairs), whole.pull)
        raise AssertionError("`check_restrictable` has refused it")

    def _pairs(self, table: PairTable) -> PairTable:
        sizes = np.diff(table.starts)[self.particles]
        ends = np.cumsum(sizes)
        taken = np.repeat(table.starts[self.particles] - (ends - sizes), sizes)
        taken = taken + np.arange(sizes.sum())
        columns = self.places[table.columns[taken]]
        inside = columns >= 0
        rows = np.repeat(np.arange(len(self.particles)), sizes)[inside]
        counts = np.bincount(rows, minlength=len(self.particles))
        return PairTable(
            starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
            columns=columns[inside].astype(np.int32),
            values=table.values[taken[inside]],
        )


@final
@attrs.frozen(eq=False)
class Frozen(ScheduledConstraint):
    """Particles that stay where they are."""

    shape: tuple[int, ...]
    entries: tuple[Indices, Indices]
    displacements: Array  # (1, m) [m]

    @classmethod
    def of(cls, particles: Indices, displacements: Array) -> Frozen:
        """These particles, of all whose displacements are given (k, d)."""
        d = displacements.shape[1]
        entries = np.repeat(particles, d), np.tile(np.arange(d), len(particles))
        return cls(displacements.shape, entries, displacements[entries][None, :])

    @property
    def label(self) -> str:
        return ASLEEP

    def schedule(self, times: Array, derivative: int) -> Array:
        return self.displacements if derivative == 0 else np.zeros_like(self.displacements)

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _Motion(ScheduledConstraint):
    whole: ScheduledConstraint
    kept: Indices  # among its entries
    entries: tuple[Indices, Indices]
    shape: tuple[int, ...]

    @property
    def label(self) -> str:
        return self.whole.label

    def schedule(self, times: Array, derivative: int) -> Array:
        return self.whole.schedule(times, derivative)[:, self.kept]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _Scheduled(ScheduledLoad):
    whole: ScheduledLoad
    kept: Indices  # among its particles
    particles: Indices

    @property
    def label(self) -> str:
        return self.whole.label

    def schedule(self, times: Array) -> Array:
        return self.whole.schedule(times)[:, self.kept]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _Pointwise(PointwiseLoad):
    label: str
    particles: Indices
    values: Array
    force: Callable[..., Any]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _Paired(PairLoad):
    label: str
    pairs: PairTable
    pull: Callable[..., Any]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


@final
@attrs.frozen(eq=False)
class _Hourglass(HourglassLoad):
    label: str
    reference: Array
    operators: Sequence[HourglassOperator]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
