"""A load out of all proportion to what it acts on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

_STRAIN = 3.0  # a stress, over Young's modulus
_SPEED = 1.0  # a velocity, over the wave speed
_TRAVEL = 10.0  # a displacement, over the length of the body
_SAG = 30.0  # deflection of a cantilever under its weight by small strains, over its length

_UNITS = "check the units: Pa, m, s, m/s^2"


def overloaded(seen: SceneFacts) -> Iterator[Advice]:
    """Stress over stiffness, velocity over wave speed, displacement over size."""
    soft = min(seen.bodies, key=lambda one: one.youngs_modulus)
    for load in seen.loads:
        strain = float(load.stresses.max()) / soft.youngs_modulus
        if strain > _STRAIN:
            yield Advice(
                found=f"{load.label!r} loads a surface with {load.stresses.max():.3g} Pa, "
                f"{strain:.3g} times Young's modulus",
                expected=f"at most {_STRAIN:g} times",
                remedy=_UNITS,
            )
        sag = 0.0 if load.on_surface else _sag(seen, float(load.accelerations.max()))
        if sag > _SAG:
            yield Advice(
                found=f"under {load.label!r} of {load.accelerations.max():.3g} m/s^2 a cantilever "
                f"so long and thin would sag by {sag:.3g} of its lengths",
                expected=f"less than {_SAG:g}",
                remedy="check youngs_modulus, the acceleration and the lengths: Pa, m/s^2 and m",
            )
    fastest = float(np.linalg.norm(seen.velocities, axis=1).max(initial=0.0))
    speeds = [("the initial state", fastest / seen.first.speed)]
    speeds += [(f"{m.label!r}", float(m.speeds.max()) / seen.first.speed) for m in seen.motions]
    for what, part in speeds:
        if part > _SPEED:
            yield Advice(
                found=f"{what} moves at {part:.3g} times the wave speed",
                expected="less: nothing solid stays whole",
                remedy=_UNITS,
            )
    longest = max(one.length for one in seen.bodies)
    for motion in seen.motions:
        if motion.peak > _TRAVEL * longest:
            yield Advice(
                found=f"{motion.label!r} moves by {motion.peak:.3g} m, {motion.peak / longest:.3g} "
                "times the length of the largest body",
                expected=f"at most {_TRAVEL:g} times",
                remedy=_UNITS,
            )


def _sag(seen: SceneFacts, acceleration: float) -> float:
    """q L^4 / (8 E I) of the slenderest supported body, over its length [-]."""
    if not acceleration > 0.0:
        return 0.0
    sags = [0.0]
    for one in seen.bodies:
        if one.supported:
            weight = one.density * acceleration
            if seen.dimension == 1:
                sags.append(weight * one.length / one.youngs_modulus)
            else:
                slender = one.length / one.thicknesses[1]
                sags.append(1.5 * weight * one.length * slender**2 / one.youngs_modulus)
    return max(sags)
