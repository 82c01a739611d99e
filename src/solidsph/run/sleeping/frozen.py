"""Frozen: constraint that holds sleeping particles in place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.compilable_terms import ScheduledConstraint
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices

ASLEEP = "asleep"
"""Account of the constraint on sleeping particles, without work and without a report."""


@final
@attrs.frozen(eq=False)
class Frozen(ScheduledConstraint):
    """Particles held in place."""

    shape: tuple[int, ...]
    entries: tuple[Indices, Indices]
    displacements: Array  # (1, m) [m]

    @classmethod
    def of(cls, particles: Indices, displacements: Array) -> Frozen:
        """Hold `particles` at their rows of `displacements` (k, d)."""
        d = displacements.shape[1]
        entries = np.repeat(particles, d), np.tile(np.arange(d), len(particles))
        return cls(displacements.shape, entries, displacements[entries][None, :])

    @property
    def label(self) -> str:
        return ASLEEP

    def schedule(self, times: Array, derivative: int, step: float = 0.0) -> Array:
        return self.displacements if derivative == 0 else np.zeros_like(self.displacements)

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
