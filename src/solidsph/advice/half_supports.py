"""Particles on a plane of symmetry whose neighbours all lie on one side."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.maths.arrays import Mask

# In spacings: on the boundary, or in one plane, up to rounding.
_ON = 1e-6


def half_supports(seen: SceneFacts) -> Iterator[Advice]:
    """By what a motion holds: particles on a face, along its normal and no other axis.

    A quarter of a sheet with a hole has a peak stress a third too high there, with ever more
    particles (test_half_supports.py); beyond a plane with ghosts it is that of the whole.
    """
    degree = min(one.body.formulation.gradient.exact_degree for one in seen.bodies)
    # A gradient of the second degree is about as good on one side.
    if seen.dimension == 1 or seen.fits_surface or degree >= 2:
        return
    for motion in seen.simulation.dynamics.constraints:
        for one in seen.bodies:
            plane = _plane(one, motion.held[one.body.extent])
            if plane is None:
                continue
            axis, at, count = plane
            yield Advice(
                found=f"{count} particles of body {one.name!r} lie on the plane of symmetry "
                f"{axis} = {at:.6g} m ({motion.label!r}), and no ghosts beyond it: half a support, "
                "with which stresses beside a hole or a notch there come out a third too high",
                expected="whole supports, or a gradient that takes the surface into account",
                remedy=f"ghosts = {ceil(seen.cover)} in the discretisation, and ghost_faces with "
                "the faces on such planes; or gradient = 'consistent'",
            )


def _plane(one: BodyFacts, held: Mask) -> tuple[str, float, int] | None:
    """Axis, place [m] and particles of the plane in which they are held, if there is one."""
    particles = one.body.particles
    X, near = particles.positions, _ON * one.spacing
    chosen = np.flatnonzero(~particles.ghosts & (held.sum(axis=1) == 1))
    if not chosen.size:
        return None
    axis = int(held[chosen[0]].argmax())
    at = float(X[chosen[0], axis])
    side = X[:, axis] - at
    real, ghosts = side[~particles.ghosts], side[particles.ghosts]
    if (
        not held[chosen, axis].all()
        or np.abs(side[chosen]).max() > near
        or np.abs(one.shape.signed_distance(X[chosen])).max() > near
    ):
        return None
    for way in (1.0, -1.0):
        if (way * real).min() >= -near:  # the body is on this side alone
            place = 0.0 if abs(at) < near else at  # rounding is no place
            return None if (way * ghosts < -near).any() else ("xyz"[axis], place, len(chosen))
    return None
