"""The meeting of two bodies, or of one with itself: what is known before they move."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Mask
from solidsph_builtin.effects._crowding import REACH, crowding_kernel, sensitivity, steepest
from solidsph_builtin.effects._meeting import Meeting
from solidsph_builtin.effects._room import ConstantRoom, MeanRoom, Room
from solidsph_builtin.effects._search import Between, Search, Within, together
from solidsph_builtin.effects._sites import FilledBeside, Sites, filled_beside, first_row, sites

# Depth of the compressed layer, 1 / integral of (dS/dz)^2 dz, relative to the support radius.
_LAYER = 0.87

# Tangential over normal stiffness, as between elastic bodies of usual Poisson's ratio (Mindlin
# 1949: 2 (1 - nu) / (2 - nu)).
_TANGENTIAL = 0.8

# Largest excess assumed for the stable step, that of a penetration by half a spacing.
_EXCESS = 0.2


def meeting_of(one: Body, other: Body, strength: float, margin: float) -> Meeting:
    """The meeting of two bodies, or of `one` with itself if it is the `other`, too.

    Args:
        one: a body.
        other: another, or the same.
        strength: 1 over the spacings of material that the contact yields as much as [-].
        margin: how far before the reach the search begins [least spacings].
    """
    bodies = one, other
    greatest = REACH * max(float(body.particles.spacings.max()) for body in bodies)
    kernel = crowding_kernel(one.particles.dimension, greatest)
    own = [sites(one, within=greatest)] if one is other else [sites(one), sites(other)]
    particles, X, volumes, spacings, depths = (
        np.concatenate([getattr(part, name) for part in own])
        for name in ("particles", "positions", "volumes", "spacings", "depths")
    )
    split = len(own[0].particles)
    belongs = np.arange(len(particles)) < split
    ranges = [(body.particles.spacings.min(), body.particles.spacings.max()) for body in bodies]
    least, most = np.where(belongs[:, None], ranges[1], ranges[0]).T  # of the other body
    radii = REACH * np.maximum(spacings, least)
    ahead = margin * float(radii.min()) / REACH
    search: Search = Between(
        together(own[0].particles), together(own[-1].particles), split, radii, greatest + ahead
    )
    if one is other:
        search = Within(particles, X, radii, ahead)
    # Bodies are taken to be refined where they meet, both or one of them.
    beside = np.clip(spacings, least, most)
    reaches = REACH * np.maximum(spacings, beside)
    modulus = _modulus(bodies, strength) * reaches / (0.5 * (spacings + beside))
    steep = steepest(kernel) * (greatest / reaches)
    sensitive = sensitivity(kernel, _EXCESS) * (greatest / reaches) ** 2
    meeting = Meeting(
        first=one.name,
        second=other.name,
        particles=particles,
        belongs=belongs,
        volumes=volumes,
        depths=depths,
        room=_room(bodies, own, belongs, kernel),
        modulus=modulus,
        spring=_TANGENTIAL * 0.5 * modulus * volumes * steep**2,
        frequency=sqrt(float(np.max(modulus * sensitive)) / _density(bodies)),
        kernel=kernel,
        search=search,
    )
    return meeting.unloaded(X)


def _density(bodies: Sequence[Body]) -> float:
    return min(body.material.density for body in bodies)


def _modulus(bodies: Sequence[Body], strength: float) -> float:
    """K [Pa] over reaches in spacings: the pressure of a penetration z is K z over the depth of
    the compressed layer."""
    first, second = (body.material.density * body.material.wave_speed**2 for body in bodies)
    return strength * 2.0 * first * second / (first + second) * _LAYER


def _room(
    bodies: Sequence[Body], own: Sequence[Sites], belongs: Mask, kernel: SmoothingKernel
) -> Room:
    spacings, depths = (
        np.concatenate([getattr(part, name) for part in own]) for name in ("spacings", "depths")
    )
    if any(body.particles.graded for body in bodies):
        filled = [FilledBeside.of(body) for body in bodies]
        rows = [
            first_row(body)[part.particles - body.extent.start]
            for part, body in zip(own, bodies, strict=False)
        ]
        none = np.zeros(len(depths))
        return MeanRoom(depths, spacings, np.concatenate(rows), filled, none)
    one, other = (filled_beside(body, kernel, depths) for body in bodies)
    return ConstantRoom(np.where(belongs, other, one))
