"""Bodies that touch, or come to each other, pass through each other if nothing keeps them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.maths.arrays import Array

_NEAR = 1.5  # spacings between particles of bodies that touch
_LOOKS = 50  # times at which the boxes are compared


def bodies_meet(seen: SceneFacts) -> Iterator[Advice]:
    """By the boxes of bodies, and where their momentum and the forces at the start carry them."""
    if len(seen.bodies) < 2 or not seen.lacks(Need.MEETING):
        return
    times = np.linspace(0.0, seen.scene.duration if seen.moves else 0.0, _LOOKS)
    for a, b in combinations(seen.bodies, 2):
        near = _NEAR * max(a.spacing, b.spacing)
        ways = _way(seen, b, times) - _way(seen, a, times)
        gaps = _gap(a, b, ways)
        if gaps[0] <= near:
            how = "touch" if gaps[0] <= 0.5 * near else f"are {gaps[0]:.3g} m apart"
        elif (gaps <= near).any():
            how = f"come together after about {times[np.argmax(gaps <= near)]:.2g} s"
        else:
            continue
        yield Advice(
            found=f"bodies {a.name!r} and {b.name!r} {how}, and nothing acts between them: they "
            "will pass through each other",
            expected="an effect of contact, or a joint",
            remedy="name one (solidsph plugins lists the effects), or move them apart",
        )


def _way(seen: SceneFacts, one: BodyFacts, times: Array) -> Array:
    """Displacement of a body's middle, (t, d) [m]; none along axes that hold it."""
    d = seen.dimension
    extent = one.body.extent
    masses = seen.simulation.model.masses[extent]
    mean = masses @ seen.velocities[extent] / masses.sum()
    pull = np.zeros(d)
    for load in seen.simulation.dynamics.loads:
        forces = load.forces(0.0, seen.simulation.initial.positions, seen.velocities)
        own = (load.particles >= extent.start) & (load.particles < extent.stop)
        pull += forces[own].sum(axis=0) / masses.sum()
    way: Array = times[:, None] * mean + 0.5 * times[:, None] ** 2 * pull
    return np.where(one.held_axes, 0.0, way)


def _gap(a: BodyFacts, b: BodyFacts, ways: Array) -> Array:
    """Distance between the surfaces' boxes, (t,) [m]; negative where they overlap.

    Two boxes may overlap where the bodies do not: at the start the particles say so.
    """
    first = np.array([a.real.min(axis=0) - a.spacing / 2, a.real.max(axis=0) + a.spacing / 2])
    other = np.array([b.real.min(axis=0) - b.spacing / 2, b.real.max(axis=0) + b.spacing / 2])
    apart = np.maximum(other[0] + ways - first[1], first[0] - other[1] - ways)
    outside = np.linalg.norm(np.maximum(apart, 0.0), axis=1)
    gaps: Array = np.where(outside > 0.0, outside, apart.max(axis=1))
    if gaps[0] <= 0.0:
        samples = a.real[:: max(1, len(a.real) // 4000)]
        gaps[0] = max(0.0, float(b.shape.signed_distance(samples).min()) - a.spacing / 2)
    return gaps
