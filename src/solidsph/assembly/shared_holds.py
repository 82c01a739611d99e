"""Motions that hold the same particles at the edges where their faces meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.compilable_terms import ScheduledConstraint
from solidsph.interfaces.terms import Observation, Term
from solidsph.maths.arrays import Array, Indices

# Times over the duration at which two motions are compared; in no proportion to a period of it.
_TIMES = np.array([0.0, 0.0137, 0.1183, 0.2719, 0.3931, 0.5557, 0.7121, 0.8843, 1.0])


@final
@attrs.frozen(eq=False)
class _Relieved(ScheduledConstraint):
    """A motion without the degrees of freedom that an earlier one moves alike."""

    whole: ScheduledConstraint
    kept: Indices  # among its entries

    @property
    def label(self) -> str:
        return self.whole.label

    @property
    def shape(self) -> tuple[int, ...]:
        return self.whole.shape

    @property
    def entries(self) -> tuple[Indices, Indices]:
        particles, axes = self.whole.entries
        return particles[self.kept], axes[self.kept]

    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        return self.whole.schedule(times, derivative, step)[:, self.kept]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return self.whole.report(observation)


def shared_once(terms: Sequence[Term], duration: float) -> list[Term]:
    """The terms, with motions that agree where they meet: the first of them moves what they share.

    Where particles lie on the surface, two faces share those of their edge, and a clamp below a
    plane of symmetry holds one of them twice. Motions that differ there are left as they are, to be
    refused; and so is one of which nothing would be left.

    Args:
        terms: bound, in the order of the scene.
        duration: of the scene [s].
    """
    found: list[Term] = []
    for term in terms:
        if isinstance(term, ScheduledConstraint):
            for other in found:
                if isinstance(other, ScheduledConstraint):
                    term = _relieved(term, other, duration * _TIMES)
        found.append(term)
    return found


def _relieved(
    later: ScheduledConstraint, first: ScheduledConstraint, times: Array
) -> ScheduledConstraint:
    if not (later.held & first.held).any():
        return later
    numbers = [np.ravel_multi_index(m.entries, m.shape) for m in (later, first)]
    _, mine, others = np.intersect1d(numbers[0], numbers[1], return_indices=True)
    here, there = later.schedule(times, 0)[:, mine], first.schedule(times, 0)[:, others]
    same = mine[(here == there).all(axis=0)]
    kept = np.setdiff1d(np.arange(len(later.entries[0])), same)
    return _Relieved(later, kept) if 0 < len(kept) < len(later.entries[0]) else later
