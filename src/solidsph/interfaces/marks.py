"""Marks: what a picture of a scene, before it runs, shows of a boundary or an effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from typing import TypeAlias, final

import attrs
import numpy as np

from solidsph.interfaces.terms import Constraint, GhostConstraint, Load, Term
from solidsph.maths.arrays import Array, Mask
from solidsph.model.fields import VectorField
from solidsph.model.particles import Particles

# Times over the duration among which that of the largest vectors is looked for.
_TIMES = 33


@final
@attrs.frozen(eq=False)
class Held:
    """Degrees of freedom whose motion is imposed."""

    freedoms: Mask  # (n, d)


@final
@attrs.frozen(eq=False)
class Arrows:
    """A vector at each of some places."""

    quantity: str  # such as "traction"
    unit: str  # of the length of a vector
    places: Array  # (k, d) [m]
    vectors: Array  # (k, d)
    time: float | None = None  # at which they are shown [s], if they vary


@final
@attrs.frozen(eq=False)
class Plane:
    """A plane, a line in two dimensions, beyond which no body comes."""

    point: Array  # (d,) [m]
    normal: Array  # (d,) of length 1


@final
@attrs.frozen(eq=False)
class Links:
    """Straight connections of two particles."""

    ends: Array  # (m, 2, d) [m]


Mark: TypeAlias = Held | Arrows | Plane | Links
"""Anything that a picture shows of a boundary or an effect."""


def field_arrows(field: VectorField, places: Array, quantity: str, unit: str) -> Arrows:
    """Arrows of a field at `places` (k, d), at the time when they are largest."""

    def vectors(time: float) -> Array:
        found = np.zeros(places.shape)
        for axis in field.components:
            found[:, axis] = field.values(axis, places, time)
        return found

    varies = any(field.varies(axis) for axis in field.components)
    return largest_arrows(vectors, field.end if varies else 0.0, places, quantity, unit)


def largest_arrows(
    vectors: Callable[[float], Array], end: float, places: Array, quantity: str, unit: str
) -> Arrows:
    """Arrows of vectors that vary up to time `end` [s], at the time when they are largest.

    Args:
        vectors: those at a time [s], (k, d).
        end: [s]; 0 if they do not vary.
        places: where they are, (k, d) [m].
        quantity: what they are.
        unit: of their length.
    """
    if not end > 0.0 or not isfinite(end):
        return Arrows(quantity, unit, places, vectors(0.0))
    times = np.linspace(0.0, end, _TIMES)
    best = max(times, key=lambda time: float(np.sum(vectors(float(time)) ** 2)))
    return Arrows(quantity, unit, places, vectors(float(best)), float(best))


def marks_of(terms: Sequence[Term], particles: Particles, end: float) -> Iterator[Mark]:
    """What terms of any kind show: whom they hold, and their forces in the undeformed bodies.

    Args:
        terms: bound.
        particles: of all bodies.
        end: of the duration [s].
    """
    X, rest = particles.positions, np.zeros(particles.positions.shape)
    for term in terms:
        if isinstance(term, Constraint) and not isinstance(term, GhostConstraint):
            yield Held(term.held)
        if isinstance(term, Load):
            yield largest_arrows(
                lambda time, load=term: load.forces(time, X, rest),  # type: ignore[misc]
                *(end, X[term.particles], "force", "N"),
            )
