"""Bodies press on each other, or on a wall, before anything has moved."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.compilable_terms import HourglassLoad
from solidsph.interfaces.terms import EnergyTerm
from solidsph.maths.arrays import Array

# Of the confined modulus: metals yield from about twice that on.
_PRESSED = 1e-3

_LISTED = 3


def pressed_at_start(seen: SceneFacts) -> Iterator[Advice]:
    """By the forces between bodies at the start, over the faces of the particles' cells."""
    particles = seen.simulation.particles
    faces = np.where(particles.ghosts, np.inf, particles.volumes) ** (1.0 - 1.0 / seen.dimension)
    moduli = np.concatenate([np.full(one.body.particles.count, one.modulus) for one in seen.bodies])
    x = particles.positions + seen.displacements
    for load in seen.simulation.dynamics.loads:
        # Hourglass control acts inside a body.
        if not isinstance(load, EnergyTerm) or isinstance(load, HourglassLoad):
            continue
        forces = np.zeros_like(x)
        forces[load.particles] = load.forces(0.0, x, seen.velocities)
        strains = np.linalg.norm(forces, axis=1) / (faces * moduli)
        worst = int(np.argmax(strains))
        if strains[worst] > _PRESSED:
            place = ", ".join(f"{c:.3g}" for c in x[worst])
            yield Advice(
                found=f"{load.label!r} acts on {_pushed(seen, forces)} at the start, at worst with "
                f"{strains[worst] * moduli[worst]:.3g} Pa at ({place}), "
                f"{100.0 * strains[worst]:.2g} % of the modulus lambda + 2 mu, as where bodies "
                "overlap or a wall cuts into one",
                expected="no force before anything moves, as between faces that just touch",
                remedy="move them apart, and give a wall no clearance, or a smaller one; if "
                "bodies are meant to be pressed together, silence this",
            )


def _pushed(seen: SceneFacts, forces: Array) -> str:
    pushed = [
        f"{one.name!r} with {np.linalg.norm(forces[one.body.extent].sum(axis=0)):.3g} N"
        for one in seen.bodies
        if forces[one.body.extent].any()
    ]
    more = [f"{len(pushed) - _LISTED} more bodies"] if len(pushed) > _LISTED else []
    return " and ".join([*pushed[:_LISTED], *more])
