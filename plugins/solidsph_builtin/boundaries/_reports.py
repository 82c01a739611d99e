"""What boundary conditions report: total forces, component by component."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.condition import Observation
from solidsph.particles import Face

COMPONENTS = ("x", "y", "z")


def stress_reaction(observation: Observation, label: str, face: Face) -> dict[str, float]:
    """Total force through `face` by the stress of its particles [N].

    Where ghosts carry the stress on beyond a held surface, as in the paper's form, no force is
    missing at its particles, and what holds them shows in the stress alone.
    """
    through = np.einsum("pij,pj->i", observation.stresses[face.particles], face.area_vectors)
    return {
        f"{label} reaction {name} [N]": float(value)
        for name, value in zip(COMPONENTS, through, strict=False)
    }


def reaction(observation: Observation, label: str) -> dict[str, float]:
    """Total force that the account `label` exerts on the body [N]."""
    applied = observation.state.applied[label].sum(axis=0)
    return {
        f"{label} reaction {name} [N]": float(value)
        for name, value in zip(COMPONENTS, applied, strict=False)
    }
