"""Safe step: the largest time step that is surely stable, from a bound on the spectrum."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

import attrs
import numpy as np

from solidsph.errors import BuildError
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.dynamics import Dynamics
from solidsph.run.linear_response import LinearResponse
from solidsph.run.spectral_bound import spectral_bound

# Vectors of the iteration, each an evaluation of the forces. From the sixth on the bound was never
# below the largest eigenvalue, in 1, 2 and 3D, for all gradients, on lattices and on jittered
# particles; by then it is within 2 %, at the twelfth within 0.5 %.
_LEAST, _MOST = 6, 30

# Share of the squared frequency by which the bound may be too large: half of it in the step.
_GAP = 0.01


@attrs.frozen(eq=False)
class SafeStep:
    """The largest step that is surely stable in a state, and what limits it."""

    step: float  # [s]
    mode: Array  # (n, d) the fastest vibration, near enough to begin with when the state changes


def safe_step(
    dynamics: Dynamics, integrator: Integrator, state: State, near: Array | None = None
) -> SafeStep | None:
    """The largest surely stable step, at most 2 % below the critical one for most scenes.

    It holds all forces of the state, at rest. Loads that may be at work later, such as contact,
    enter by the rates that they declare, and so does damping.

    Args:
        dynamics: any equation of motion.
        integrator: its stability limit.
        state: linearisation point.
        near: a shape (n, d) near the fastest vibration, from a state before.

    Returns:
        None where nothing vibrates: nothing is free, or forces do not grow with displacements; and
        where forces are not finite or cannot be formed.
    """
    if not dynamics.free.any():
        return None
    try:
        response = LinearResponse.about(dynamics, state)
        start = np.random.default_rng(state.step).standard_normal(len(response.roots))
        if near is not None:
            known = response.scaled(near)
            size = float(np.sqrt(np.einsum("i,i->", known, known)))
            start += known * (sqrt(len(known)) / size if size > 0.0 else 0.0)
        found = spectral_bound(response.times, start, least=_LEAST, most=_MOST, gap=_GAP)
    except BuildError:  # moving neighbours may not determine a gradient
        return None
    if found is None or not 0.0 < found.bound < np.inf:
        return None
    step = stable_step_of(found.bound, integrator, dynamics.loads)
    return SafeStep(step, response.shape(found.vector))


def stable_step_of(square: float, integrator: Integrator, loads: Iterable[Load]) -> float:
    """Largest stable step [s] under a square of the highest frequency, from a spectrum [1/s^2].

    Loads add the rates that they declare: of damping, and of stiffness that a state may not show.
    """
    loads = list(loads)
    square += sum(load.stiffness_rate**2 for load in loads if not load.acts_always)
    total = sqrt(square) + sum(load.damping_rate for load in loads)
    return integrator.stability_limit / total if total > 0.0 else float("inf")
