"""Where the names of faces and tags stand in a picture of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.maths.arrays import Array, Indices

# Names that a picture has room for; of more faces the largest are named.
_MOST = 30

_NEAR = 0.05  # distance of names that are written as one, over the size of the scene

_TOGETHER = 3  # names in one place, at most


@final
@attrs.frozen(eq=False)
class NamedPlace:
    """The middle of a named face or tag, at a particle of it."""

    name: str
    place: Array  # (d,) [m]
    outward: Array  # (d,) of length 1, or 0 where there is no surface
    is_face: bool


def named_places(model: DiscreteModel) -> Sequence[NamedPlace]:
    """Faces, the largest first, and tags that the scene adds, of every body."""
    particles, pieces = model.particles, model.pieces()
    X, bodies = particles.positions, list(particles.bodies)
    found = []
    each = np.stack([pieces.bodies, pieces.faces], axis=1)
    for body, face in np.unique(each, axis=0).tolist():
        own = (pieces.bodies == body) & (pieces.faces == face) & (pieces.areas > 0.0)
        if own.any():
            owners, areas = pieces.owners[own], pieces.areas[own]
            nearest = _middle(X[owners], areas)
            outward = _direction(pieces.area_vectors[own][nearest])
            name = _of(bodies, body, pieces.names[face])
            found.append((float(areas.sum()), NamedPlace(name, X[owners[nearest]], outward, True)))
    places = [place for _, place in sorted(found, key=lambda one: -one[0])[:_MOST]]
    for tag in model.conditions:
        for number, extent in enumerate(particles.bodies.values()):
            chosen: Indices = np.flatnonzero(particles.tags[tag][extent]) + extent.start
            if len(chosen):
                middle = chosen[_middle(X[chosen], np.ones(len(chosen)))]
                outward = _direction(particles.area_vectors[middle])
                name = _of(bodies, number, tag)
                places.append(NamedPlace(name, X[middle], outward, False))
    return _apart(places, _NEAR * float(np.ptp(X, axis=0).max()))


def _apart(places: Sequence[NamedPlace], distance: float) -> Sequence[NamedPlace]:
    """The places, with those closer together than `distance` [m] and on one side made one, which
    has the names of the largest."""
    found: list[NamedPlace] = []
    for one in places:
        for k, other in enumerate(found):
            near = float(np.linalg.norm(one.place - other.place)) < distance
            if near and float(one.outward @ other.outward) > 0.5:
                if other.name.count(",") < _TOGETHER - 1:
                    found[k] = attrs.evolve(other, name=f"{other.name}, {one.name}")
                break
        else:
            found.append(one)
    return found


def _middle(points: Array, weights: Array) -> int:
    """Number of the point nearest to the mean of points (k, d)."""
    mean = weights @ points / weights.sum()
    return int(np.argmin(np.linalg.norm(points - mean, axis=1)))


def _direction(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector


def _of(bodies: Sequence[str], body: int, name: str) -> str:
    return f"{bodies[body]}.{name}" if len(bodies) > 1 else name
