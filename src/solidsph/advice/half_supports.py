"""Particles on a plane of symmetry whose neighbours all lie on one side."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.maths.arrays import Mask

# Distance in spacings that counts as rounding: on the boundary, or in one plane.
_ON = 1e-6


def half_supports(facts: SceneFacts) -> Iterator[Advice]:
    """Find particles on a face that are held along its normal and no other axis.

    The peak stress of a quarter of a sheet with a hole is a third too high there, with ever more
    particles (test_half_supports.py); with ghosts beyond the plane it is that of the whole sheet.
    """
    degree = min(body.exact_degree for body in facts.bodies)
    # A gradient of the second degree is about as good on one side.
    if facts.dimension == 1 or facts.fits_surface or degree >= 2:
        return
    for motion in facts.simulation.dynamics.constraints:
        for body in facts.bodies:
            plane = _plane(body, motion.held[body.extent])
            if plane is None:
                continue
            axis, at, count = plane
            yield Advice(
                finding=f"{count} particles of body {body.name!r} lie on the plane of symmetry "
                f"{axis} = {at:.6g} m ({motion.label!r}), and no ghosts beyond it: half a support, "
                "with which stresses beside a hole or a notch there come out a third too high",
                expected="whole supports, or a gradient that takes the surface into account",
                remedy=f"ghosts = {ceil(facts.cover)} in the discretisation, and ghost_faces with "
                "the faces on such planes; or gradient = 'consistent'",
            )


def _plane(body: BodyFacts, held: Mask) -> tuple[str, float, int] | None:
    """Axis, place [m] and particles of the plane of symmetry without ghosts, if there is one."""
    particles = body.body.particles
    X, near = particles.positions, _ON * body.spacing
    chosen = np.flatnonzero(~particles.ghosts & (held.sum(axis=1) == 1))
    if not chosen.size:
        return None
    axis = int(held[chosen[0]].argmax())
    at = float(X[chosen[0], axis])
    heights = X[:, axis] - at
    real, ghosts = heights[~particles.ghosts], heights[particles.ghosts]
    if (
        not held[chosen, axis].all()
        or np.abs(heights[chosen]).max() > near
        or np.abs(body.body.shape.signed_distance(X[chosen])).max() > near
    ):
        return None
    for side in (1.0, -1.0):
        if (side * real).min() >= -near:  # the body is on this side alone
            place = 0.0 if abs(at) < near else at  # without rounding
            return None if (side * ghosts < -near).any() else ("xyz"[axis], place, len(chosen))
    return None
