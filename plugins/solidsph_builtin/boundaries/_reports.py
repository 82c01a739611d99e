"""Reports of boundary conditions: total forces and moments, component by component."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.model.particles import Face

COMPONENTS = ("x", "y", "z")


def stress_reaction(observation: Observation, label: str, face: Face) -> dict[str, float]:
    """Resultant of the stress of a face's particles through the face.

    If ghosts continue the stress beyond a held surface, as in the paper's form, the forces on its
    particles are balanced, and the reaction shows in the stress alone.
    """
    through = np.einsum("pij,pj->pi", observation.stresses[face.particles], face.area_vectors)
    return resultant(
        f"{label} reaction",
        f"{label} reaction moment",
        observation.state.positions[face.particles],
        through,
    )


def reaction(observation: Observation, label: str) -> dict[str, float]:
    """Resultant of the forces of the account `label` on the body."""
    state = observation.state
    return resultant(
        f"{label} reaction", f"{label} reaction moment", state.positions, state.applied[label]
    )


def asked_resultant(label: str, positions: Array, forces: Array) -> dict[str, float]:
    """Resultant of a load as given."""
    return resultant(f"{label} asked resultant", f"{label} asked moment", positions, forces)


def resultant(force: str, moment: str, positions: Array, forces: Array) -> dict[str, float]:
    """Total of `forces` (k, d) [N], and their moment about the origin x = y = z = 0 [N m].

    The moment is that of the forces at their current `positions` (k, d) [m]. About a point c it is
    less by c x R, with R the total force. In two dimensions it has a component about z only, in one
    dimension none.
    """
    d = forces.shape[1]
    columns = {
        f"{force} {COMPONENTS[k]} [N]": float(total) for k, total in enumerate(forces.sum(axis=0))
    }
    for axis in {1: (), 2: (2,), 3: (0, 1, 2)}[d]:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        about = positions[:, i] @ forces[:, j] - positions[:, j] @ forces[:, i]
        columns[f"{moment} {COMPONENTS[axis]} [N m]"] = float(about)
    return columns
