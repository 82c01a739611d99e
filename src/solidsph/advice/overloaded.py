"""A load, velocity, displacement or weight out of all proportion to the body."""

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


def overloaded(facts: SceneFacts) -> Iterator[Advice]:
    """Compare stress with stiffness, velocity with wave speed, displacement with size."""
    softest = min(body.youngs_modulus for body in facts.bodies)
    for load in facts.loads:
        stress = float(load.stresses.max())
        if stress / softest > _STRAIN:
            yield Advice(
                finding=f"{load.label!r} loads a surface with {stress:.3g} Pa, "
                f"{stress / softest:.3g} times Young's modulus",
                expected=f"at most {_STRAIN:g} times",
                remedy=_UNITS,
            )
        # Forces of contact are large, and cancel.
        acceleration = float(load.mean_accelerations.max())
        sag = 0.0 if load.on_surface else _sag(facts, acceleration)
        if sag > _SAG:
            yield Advice(
                finding=f"under {load.label!r} of {acceleration:.3g} m/s^2 a cantilever "
                f"so long and thin would sag by {sag:.3g} of its lengths",
                expected=f"less than {_SAG:g}",
                remedy="check youngs_modulus, the acceleration and the lengths: Pa, m/s^2 and m",
            )
    initial = float(np.linalg.norm(facts.velocities, axis=1).max(initial=0.0))
    speeds = [("the initial state", initial)]
    speeds += [(repr(motion.label), float(motion.speeds.max())) for motion in facts.motions]
    for what, speed in speeds:
        if speed / facts.fastest.speed > _SPEED:
            yield Advice(
                finding=f"{what} moves at {speed / facts.fastest.speed:.3g} times the wave speed",
                expected="less: no solid stays whole",
                remedy=_UNITS,
            )
    longest = max(body.length for body in facts.bodies)
    for motion in facts.motions:
        if motion.peak > _TRAVEL * longest:
            yield Advice(
                finding=f"{motion.label!r} moves by {motion.peak:.3g} m, "
                f"{motion.peak / longest:.3g} times the length of the largest body",
                expected=f"at most {_TRAVEL:g} times",
                remedy=_UNITS,
            )


def _sag(facts: SceneFacts, acceleration: float) -> float:
    """Deflection q L^4 / (8 E I) of the slenderest held body, over its length [-]."""
    sags = [0.0]
    for body in facts.bodies if acceleration > 0.0 else ():
        if body.is_held:
            stretch = body.density * acceleration * body.length / body.youngs_modulus
            if facts.dimension > 1:
                stretch *= 1.5 * (body.length / body.thicknesses[1]) ** 2
            sags.append(stretch)
    return max(sags)
