"""A load on several faces that its condition does not name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.regions import AXES, Where, names_used
from solidsph.model.surface import Pieces
from solidsph.registry.construct import construct

_SHOWN = 6  # faces of one load

# Cosine from the normal, and distance over that of particles of two bodies that touch, within which
# a particle of another body covers a piece of surface.
_AHEAD, _TOUCHING = 0.75, 1.5

# In spacings: particles closer than this are in one place. And the distance of a unit normal from
# one turned round, below which the two are opposite.
_SAME, _OPPOSITE = 1e-3, 0.5


def several_faces(facts: SceneFacts) -> Iterator[Advice]:
    """Compare the areas that a load takes of each face.

    A corner that is picked by coordinates owns some of every face that meets there, and so do the
    rims of "surface and Z > 0.1". A condition of names alone, such as "surface" or "not left",
    means all of it. So does the name of a face that several bodies have, unless one such face lies
    against another body.
    """
    pieces = facts.simulation.model.pieces()
    for entry in facts.scene.boundaries:
        handler: BoundaryHandler = construct("boundaries", entry.part)
        where: Where | None = getattr(handler, "where", None)
        if not handler.loads_surface or where is None:
            continue
        names = _names(pieces, where)
        chosen = pieces.at(where) & (pieces.areas > 0.0)
        loose = pieces.unnamed(where) & chosen
        shares = _shares(pieces, chosen)
        if loose.any() and len(shares) > 1 and names & {*AXES}:
            none = loose.sum() == chosen.sum()
            why = "names no face" if none else "names one face, and meets more"
        elif _in_several_bodies(pieces, chosen, names) and _covered(pieces, chosen):
            why = "names a face that several bodies have, one of which lies against another"
        else:
            continue
        largest = sorted(shares, key=lambda face: -shares[face])
        total = sum(shares.values())
        listed = [f"{face} {shares[face] / total:.0%}" for face in largest[:_SHOWN]]
        if len(largest) > _SHOWN:
            listed.append(f"{len(largest) - _SHOWN} more")
        unit = {1: "", 2: " m", 3: " m^2"}[facts.dimension]
        shown = f"where = {where!r}" if isinstance(where, str) else "its function"
        yield Advice(
            finding=f"{entry.label or type(handler).__name__}: {shown} {why}, and what it loads, "
            f"{total:.4g}{unit}, is on {', '.join(listed)}",
            expected="a load on the faces that its condition names",
            remedy=_remedy(where, largest, names),
        )


def _names(pieces: Pieces, where: Where) -> frozenset[str]:
    """Names in a condition, and in the conditions of the scene's own tags in it."""
    if not isinstance(where, str):
        return frozenset(AXES)  # a function of positions
    names = names_used(pieces.particles, where)
    for tag in [name.split(".")[-1] for name in names]:
        for _, condition in pieces.conditions.get(tag, ()):
            names |= _names(pieces, condition)
    return names


def _shares(pieces: Pieces, chosen: Mask) -> dict[str, float]:
    """Area by face [m^(d-1)], and by body where there are several."""
    bodies = list(pieces.particles.bodies)
    areas: dict[str, float] = {}
    each = np.stack([pieces.bodies[chosen], pieces.faces[chosen]], axis=1)
    for body, face in np.unique(each, axis=0):
        own = chosen & (pieces.bodies == body) & (pieces.faces == face)
        prefix = f"{bodies[body]}." if len(bodies) > 1 else ""
        areas[prefix + pieces.names[face]] = float(pieces.areas[own].sum())
    return areas


def _in_several_bodies(pieces: Pieces, chosen: Mask, names: frozenset[str]) -> bool:
    """True if a condition that names no body names a face of several."""
    particles = pieces.particles
    if len(particles.bodies) < 2 or names & {*particles.bodies, *pieces.conditions}:
        return False
    named = np.isin(pieces.faces, [pieces.names.index(f) for f in names if f in pieces.names])
    return bool(np.unique(pieces.bodies[chosen & named]).size > 1)


def _covered(pieces: Pieces, chosen: Mask) -> bool:
    """True if some of the chosen surface faces a particle of another body that touches it."""
    particles = pieces.particles
    X, spacings = particles.positions, particles.spacings
    numbers = np.flatnonzero(chosen)
    for k, extent in enumerate(particles.bodies.values()):
        own = numbers[pieces.bodies[numbers] == k]
        others = ~particles.ghosts
        others[extent] = False
        if not len(own) or not others.any():
            continue
        owners, normals = pieces.owners[own], pieces.area_vectors[own]
        gaps, near = cKDTree(X[others]).query(X[owners])
        ahead = np.einsum("ki,ki->k", X[others][near] - X[owners], normals)
        facing = ahead > _AHEAD * gaps * np.linalg.norm(normals, axis=1)
        touching = gaps < _TOUCHING * 0.5 * (spacings[owners] + spacings[others][near])
        if np.any(facing & touching) or _against(pieces, own, pieces.bodies != k):
            return True
    return False


def _against(pieces: Pieces, own: Indices, others: Mask) -> bool:
    """True if a piece of `own` and one of `others` (m,), opposite to it, have particles in one
    place, as on faces of two bodies that touch and have particles on the surface."""
    rest = np.flatnonzero(others & (pieces.areas > 0.0))
    if not rest.size:
        return False
    X = pieces.particles.positions
    size = _SAME * pieces.particles.spacings.min()

    def signs(numbers: Indices, side: float) -> Array:
        normals = pieces.area_vectors[numbers] / pieces.areas[numbers, None]
        return np.hstack([X[pieces.owners[numbers]] / size, side * normals])

    gaps = cKDTree(signs(rest, -1.0)).query(signs(own, 1.0))[0]
    return bool(np.any(gaps < _OPPOSITE))


def _remedy(where: Where, faces: list[str], names: frozenset[str]) -> str:
    if not isinstance(where, str):
        return f"name the face: where = {faces[0]!r} and tags"
    every = " or ".join(faces[:_SHOWN])
    if not names & {*AXES}:
        return f"name the body: where = {faces[0]!r}, or {every!r} if all are meant"
    return f"where = '{faces[0]} and ({where})', or '({every}) and ({where})' if all are meant"
