"""Probe: a named measurement, before it is bound to particles."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import Term
from solidsph.model.particles import Particles


@attrs.frozen(eq=False)
class Probe(ABC):
    """Something to measure. Bound to a model it is a term that reports, and does nothing else."""

    label: str  # the beginning of its columns

    @abstractmethod
    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        """Raise SceneError unless its place is in the bodies, whether or not the scene is right."""

    @abstractmethod
    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        """The term that measures it.

        Args:
            model: the bodies.
            accounts: labels of all boundaries and effects that exert forces.

        Raises:
            SceneError: its place is outside of the bodies, or it cannot be known there.
        """


@contextmanager
def named(probe: Probe) -> Iterator[None]:
    """Begin the messages of scene errors in the block with the label of the probe."""
    try:
        yield
    except SceneError as cause:
        raise SceneError(f"probe {probe.label!r}: {cause}") from cause
