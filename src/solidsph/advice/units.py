"""Numbers that no solid has: units are mixed up."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

# From foams and gels to heavy metals and diamond; most densities in g/cm^3 are below.
_DENSITIES = (10.0, 3e4)  # [kg/m^3]
_SPEEDS = (0.3, 2e4)  # [m/s]

_DENSITY_REMEDY = "density is in kg/m^3: steel has 7850"
_SPEED_REMEDY = "youngs_modulus is in Pa and density in kg/m^3: steel has 210e9 and 7850"


def units(facts: SceneFacts) -> Iterator[Advice]:
    """Check density and wave speed of every body, where mass has any effect."""
    weights = (load.accelerations.any() and not load.on_surface for load in facts.loads)
    if not facts.is_motion and not any(weights):
        return
    for body in facts.bodies:
        for what, value, (least, most), unit, remedy in (
            ("density", body.density, _DENSITIES, "kg/m^3", _DENSITY_REMEDY),
            ("a confined wave speed", body.speed, _SPEEDS, "m/s", _SPEED_REMEDY),
        ):
            if not least <= value <= most:
                yield Advice(
                    finding=f"body {body.name!r} has {what} of {value:.4g} {unit}",
                    expected=f"{least:g} to {most:g} {unit} in solids",
                    remedy=remedy,
                )
