"""Forces on a body that nothing holds: it flies away."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.maths.arrays import Array

_FAR = 5.0  # lengths of the body


def unheld(seen: SceneFacts) -> Iterator[Advice]:
    """How far the forces carry it in the duration; an equilibrium does not even exist."""
    if not seen.lacks(Need.MEETING):
        return
    for one in seen.bodies:
        pull = np.where(one.held_axes, 0.0, _pull(seen, one, 0.0))
        size = float(np.linalg.norm(pull))
        way = 0.5 * size * seen.scene.duration**2
        if size == 0.0 or (seen.moves and way <= _FAR * one.length):
            continue
        if seen.moves and _pull(seen, one, way / size * pull) @ pull < 0.0:
            continue  # a wall is in the way
        where = f"it will be {way:.3g} m away at the end" if seen.moves else "no equilibrium exists"
        yield Advice(
            found=f"nothing holds body {one.name!r} against what pulls it with "
            f"{size:.3g} m/s^2: {where}",
            expected="a boundary that holds it",
            remedy="add [[boundary]] 'clamp' or 'symmetry', or balance the forces",
        )


def _pull(seen: SceneFacts, one: BodyFacts, moved: Array | float) -> Array:
    """Mean acceleration at the end of the duration, were it `moved` [m], (d,) [m/s^2]."""
    simulation, extent = seen.simulation, one.body.extent
    masses = simulation.model.masses[extent]
    pull = np.zeros(seen.dimension)
    rest = np.zeros_like(seen.velocities)
    positions = simulation.initial.positions.copy()
    positions[extent] += moved
    for load in simulation.dynamics.loads:
        forces = load.forces(simulation.scene.duration, positions, rest)
        own = (load.particles >= extent.start) & (load.particles < extent.stop)
        pull += forces[own].sum(axis=0) / masses.sum()
    # What rounding leaves of forces that balance pulls nothing.
    scale = sum(float(load.accelerations.max()) for load in seen.loads)
    return np.where(np.abs(pull) > 1e-6 * scale, pull, 0.0)
