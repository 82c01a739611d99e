"""Bodies that press on each other, or on a wall, before anything has moved."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.compilable_terms import HourglassLoad
from solidsph.interfaces.terms import EnergyTerm
from solidsph.maths.arrays import Array

# Share of the confined modulus: metals yield from about twice that on.
_PRESSED = 1e-3

_LISTED = 3


def pressed_at_start(facts: SceneFacts) -> Iterator[Advice]:
    """Divide the forces between bodies at the start by the faces of cells and the modulus."""
    particles = facts.simulation.particles
    faces = np.where(particles.ghosts, np.inf, particles.volumes) ** (1.0 - 1.0 / facts.dimension)
    moduli = np.concatenate([np.full(b.body.particles.count, b.modulus) for b in facts.bodies])
    x = particles.positions + facts.displacements
    for load in facts.simulation.dynamics.loads:
        # Hourglass control acts inside a body.
        if not isinstance(load, EnergyTerm) or isinstance(load, HourglassLoad):
            continue
        forces = np.zeros_like(x)
        forces[load.particles] = load.forces(0.0, x, facts.velocities)
        strains = np.linalg.norm(forces, axis=1) / (faces * moduli)
        worst = int(np.argmax(strains))
        if strains[worst] > _PRESSED:
            place = ", ".join(f"{c:.3g}" for c in x[worst])
            yield Advice(
                finding=f"{load.label!r} acts on {_pushed(facts, forces)} at the start, at worst "
                f"with {strains[worst] * moduli[worst]:.3g} Pa at ({place}), "
                f"{100.0 * strains[worst]:.2g} % of the modulus lambda + 2 mu, as where bodies "
                "overlap or a wall cuts into one",
                expected="no force before anything moves, as between faces that just touch",
                remedy="move them apart, and give a wall no clearance, or a smaller one; if "
                "bodies are meant to be pressed together, silence this",
            )


def _pushed(facts: SceneFacts, forces: Array) -> str:
    pushed = [
        f"{body.name!r} with {np.linalg.norm(forces[body.extent].sum(axis=0)):.3g} N"
        for body in facts.bodies
        if forces[body.extent].any()
    ]
    more = [f"{len(pushed) - _LISTED} more bodies"] if len(pushed) > _LISTED else []
    return " and ".join([*pushed[:_LISTED], *more])
