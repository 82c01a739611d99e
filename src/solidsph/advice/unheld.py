"""Forces on a body that nothing holds: it flies away."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.maths.arrays import Array

_FAR = 5.0  # lengths of the body


def unheld(facts: SceneFacts) -> Iterator[Advice]:
    """Find how far the forces carry a body, or that an equilibrium does not exist."""
    if not facts.lacks(Need.MEETING):
        return
    for body in facts.bodies:
        pull = np.where(body.held_axes, 0.0, _pull(facts, body, 0.0))
        size = float(np.linalg.norm(pull))
        path = 0.5 * size * facts.scene.duration**2
        if size == 0.0 or (facts.is_motion and path <= _FAR * body.length):
            continue
        if facts.is_motion and _pull(facts, body, path / size * pull) @ pull < 0.0:
            continue  # a wall is in the way
        result = (
            f"it will be {path:.3g} m away at the end"
            if facts.is_motion
            else "no equilibrium exists"
        )
        yield Advice(
            finding=f"nothing holds body {body.name!r} against what pulls it with "
            f"{size:.3g} m/s^2: {result}",
            expected="a boundary that holds it",
            remedy="add [[boundary]] 'clamp' or 'symmetry', or balance the forces",
        )


def _pull(facts: SceneFacts, body: BodyFacts, moved: Array | float) -> Array:
    """Mean acceleration at the end of the duration, if the body is `moved` [m], (d,) [m/s^2]."""
    positions = facts.simulation.initial.positions.copy()
    positions[body.extent] += moved
    rest = np.zeros_like(facts.velocities)
    pull = facts.acceleration(body, facts.scene.duration, positions, rest)
    # Rounding of forces that balance does not count.
    scale = sum(float(load.accelerations.max()) for load in facts.loads)
    return np.where(np.abs(pull) > 1e-6 * scale, pull, 0.0)
