"""Binding of probes to a discrete model."""

from __future__ import annotations

from collections.abc import Collection

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Term
from solidsph.probes.probe import Probe, named


def bind_probe(probe: Probe, model: DiscreteModel, accounts: Collection[str]) -> Term:
    """The term of a probe.

    Raises:
        SceneError: its place is outside of the bodies, or what it measures is not known.
    """
    with named(probe):
        return probe.bind(model, accounts)
