"""Numbers that no solid has: units are mixed up."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

# From foams and gels to heavy metals and diamond; most that is in g/cm^3 falls below.
_DENSITIES = (10.0, 3e4)  # [kg/m^3]
_SPEEDS = (0.3, 2e4)  # [m/s]


def units(seen: SceneFacts) -> Iterator[Advice]:
    """Density and wave speed of every body, where its mass is of any effect."""
    if not seen.moves and not any(
        load.accelerations.any() and not load.on_surface for load in seen.loads
    ):
        return
    for one in seen.bodies:
        for what, value, (least, most), unit, remedy in (
            ("density", one.density, _DENSITIES, "kg/m^3", "density is in kg/m^3: steel has 7850"),
            (
                "a confined wave speed",
                one.speed,
                _SPEEDS,
                "m/s",
                "youngs_modulus is in Pa and density in kg/m^3: steel has 210e9 and 7850",
            ),
        ):
            if not least <= value <= most:
                yield Advice(
                    found=f"body {one.name!r} has {what} of {value:.4g} {unit}",
                    expected=f"{least:g} to {most:g} {unit} in solids",
                    remedy=remedy,
                )
