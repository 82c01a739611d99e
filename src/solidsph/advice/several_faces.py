"""A load on several faces, of which its condition names none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.seen import Seen
from solidsph.arrays import Mask
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.particles import Particles
from solidsph.parts import construct
from solidsph.surface import Pieces
from solidsph.where import AXES, Where, names_used

_SHOWN = 6  # faces of one load


def several_faces(seen: Seen) -> Iterator[Advice]:
    """By the area that a load takes of each face.

    A corner that is picked by coordinates owns some of every face that meets there, and a face of
    one name may be there on several bodies. Where the condition consists of names alone, such as
    "not left" or "surface", whole faces are meant.
    """
    pieces = Pieces.of(seen.simulation.particles)
    for entry in seen.scene.boundaries:
        handler: BoundaryHandler = construct("boundaries", entry.part)
        where: Where | None = getattr(handler, "where", None)
        if not handler.loads_surface or where is None:
            continue
        names = _names(pieces.particles, where)
        chosen = pieces.at(where) & (pieces.areas > 0.0)
        loose = pieces.unnamed(where) & chosen
        shares = _shares(pieces, chosen)
        if loose.any() and len(shares) > 1 and names & {*AXES}:
            why = (
                "names no face" if loose.sum() == chosen.sum() else "names one face, and meets more"
            )
        elif _in_several_bodies(pieces, chosen, names):
            why = "names a face that several bodies have"
        else:
            continue
        largest = sorted(shares, key=lambda face: -shares[face])
        total = sum(shares.values())
        listed = [f"{face} {shares[face] / total:.0%}" for face in largest[:_SHOWN]]
        if len(largest) > _SHOWN:
            listed.append(f"{len(largest) - _SHOWN} more")
        unit = {1: "", 2: " m", 3: " m^2"}[seen.dimension]
        shown = f"where = {where!r}" if isinstance(where, str) else "its function"
        yield Advice(
            found=f"{entry.label or type(handler).__name__}: {shown} {why}, and what it loads, "
            f"{total:.4g}{unit}, is on {', '.join(listed)}",
            expected="a load on the faces that its condition names",
            remedy=_remedy(where, largest, names),
        )


def _names(particles: Particles, where: Where) -> frozenset[str]:
    """What a condition names, and the conditions of the scene's own tags in it."""
    if not isinstance(where, str):
        return frozenset(AXES)  # a function of positions
    names = names_used(particles, where)
    own = [name.split(".")[-1] for name in names]
    for tag in own:
        for _, condition in particles.conditions.get(tag, ()):
            names |= _names(particles, condition)
    return names


def _shares(pieces: Pieces, chosen: Mask) -> dict[str, float]:
    """Area by face [m^(d-1)], of each body where there are several."""
    bodies = list(pieces.particles.bodies)
    areas: dict[str, float] = {}
    each = np.stack([pieces.bodies[chosen], pieces.faces[chosen]], axis=1)
    for body, face in np.unique(each, axis=0):
        own = chosen & (pieces.bodies == body) & (pieces.faces == face)
        prefix = f"{bodies[body]}." if len(bodies) > 1 else ""
        areas[prefix + pieces.names[face]] = float(pieces.areas[own].sum())
    return areas


def _in_several_bodies(pieces: Pieces, chosen: Mask, names: frozenset[str]) -> bool:
    """Whether a face was named by a condition that names no body."""
    particles = pieces.particles
    if len(particles.bodies) < 2 or names & {*particles.bodies, *particles.conditions}:
        return False
    named = np.isin(pieces.faces, [pieces.names.index(f) for f in names if f in pieces.names])
    return bool(np.unique(pieces.bodies[chosen & named]).size > 1)


def _remedy(where: Where, faces: list[str], names: frozenset[str]) -> str:
    if not isinstance(where, str):
        return f"name the face: where = {faces[0]!r} and tags"
    if not names & {*AXES}:
        every = " or ".join(faces[:_SHOWN])
        return f"name the body: where = {faces[0]!r}, or {every!r} if all are meant"
    every = " or ".join(faces[:_SHOWN])
    return f"where = '{faces[0]} and ({where})', or '({every}) and ({where})' if all are meant"
