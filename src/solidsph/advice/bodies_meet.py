"""Bodies that touch or approach each other, with nothing between them: they will overlap."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.maths.arrays import Array

_NEAR = 1.5  # spacings between particles of bodies that touch
_TIMES = 50  # at which the bounding boxes are compared


def bodies_meet(facts: SceneFacts) -> Iterator[Advice]:
    """Compare bounding boxes, moved by the momentum and the loads at the start."""
    if len(facts.bodies) < 2 or not facts.lacks(Need.MEETING):
        return
    times = np.linspace(0.0, facts.scene.duration if facts.is_motion else 0.0, _TIMES)
    for a, b in combinations(facts.bodies, 2):
        near = _NEAR * max(a.largest_spacing, b.largest_spacing)
        gaps = _gaps(a, b, _path(facts, b, times) - _path(facts, a, times))
        if gaps[0] <= near:
            how = "touch" if gaps[0] <= 0.5 * near else f"are {gaps[0]:.3g} m apart"
        elif (gaps <= near).any():
            how = f"come together after about {times[np.argmax(gaps <= near)]:.2g} s"
        else:
            continue
        yield Advice(
            finding=f"bodies {a.name!r} and {b.name!r} {how}, and nothing acts between them: they "
            "will pass through each other",
            expected="an effect of contact, or a joint",
            remedy="name one (solidsph plugins lists the effects), or move them apart",
        )


def _path(facts: SceneFacts, body: BodyFacts, times: Array) -> Array:
    """Displacement of a body's middle, (t, d) [m]; none along axes that hold it."""
    masses = facts.simulation.model.masses[body.extent]
    velocity = masses @ facts.velocities[body.extent] / masses.sum()
    positions = facts.simulation.initial.positions
    acceleration = facts.acceleration(body, 0.0, positions, facts.velocities)
    path: Array = times[:, None] * velocity + 0.5 * times[:, None] ** 2 * acceleration
    return np.where(body.held_axes, 0.0, path)


def _gaps(a: BodyFacts, b: BodyFacts, paths: Array) -> Array:
    """Distance between the bounding boxes, (t,) [m]; negative where they overlap.

    Boxes may overlap where bodies do not, so at the start the particles decide.
    """
    low_a, high_a = a.real.min(axis=0) - a.spacing / 2, a.real.max(axis=0) + a.spacing / 2
    low_b, high_b = b.real.min(axis=0) - b.spacing / 2, b.real.max(axis=0) + b.spacing / 2
    apart = np.maximum(low_b + paths - high_a, low_a - high_b - paths)
    outside = np.linalg.norm(np.maximum(apart, 0.0), axis=1)
    gaps: Array = np.where(outside > 0.0, outside, apart.max(axis=1))
    if gaps[0] <= 0.0:
        samples = a.real[:: max(1, len(a.real) // 4000)]
        gaps[0] = max(0.0, float(b.body.shape.signed_distance(samples).min()) - a.spacing / 2)
    return gaps
