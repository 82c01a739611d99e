"""Binding of boundaries and effects to a discrete model, with checks of what they return."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from solidsph.errors import BuildError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Load, Term
from solidsph.registry import registry
from solidsph.registry.origin import described
from solidsph.scene.checks.returned import check_bound, check_indices, check_rates


def bind(kind: str, part: Any, model: DiscreteModel, label: str) -> Sequence[Term]:
    """Terms of a boundary or effect.

    Raises:
        BuildError: the part returned something unusable.
    """
    bound = part.bind(model, label)
    problems = list(check_bound(kind, label, part, bound))
    if problems:
        raise BuildError(problems)
    terms: Sequence[Term] = [bound] if kind == "effects" else bound
    particles = model.particles
    for term in terms:
        problems += check_indices(term, particles.count, particles.dimension)
    if not problems:
        for term in terms:
            if isinstance(term, Load):
                problems += check_rates(term)
    if problems:
        who = described(registry.entry_of(kind, part))
        raise BuildError([f"{who}, {problem}" for problem in problems])
    return terms
