"""What boundary conditions report: total forces, component by component."""

from __future__ import annotations

from solidsph.interfaces.condition import Observation

COMPONENTS = ("x", "y", "z")


def reaction(observation: Observation, label: str) -> dict[str, float]:
    """Total force that the account `label` exerts on the body [N]."""
    applied = observation.state.applied[label].sum(axis=0)
    return {
        f"{label} reaction {name} [N]": float(value)
        for name, value in zip(COMPONENTS, applied, strict=False)
    }
