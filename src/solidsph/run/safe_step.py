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

# Vectors of the iteration, each an evaluation of the forces; and the share of the squared frequency
# by which the bound may be too large. Of 108 blocks in 1, 2 and 3D, with every gradient, covers of
# 2 to 3.5, on lattices and jittered, with six starts each, it takes 15 on average. Where corners
# or jitter make many nearly equal modes, the bound is up to 0.7 % too small, hence the margin.
_LEAST, _MOST, _GAP = 8, 30, 0.002
_MARGIN = 1.01

# When a mode is known, and the question is only whether the step is still well below.
_LEAST_AGAIN, _GAP_AGAIN = 6, 0.02


@attrs.frozen(eq=False)
class SafeStep:
    """The largest step that is surely stable in a state, and what limits it."""

    step: float  # [s]
    mode: Array  # (n, d) the fastest vibration, near enough to begin with when the state changes


def safe_step(
    dynamics: Dynamics, integrator: Integrator, state: State, near: Array | None = None
) -> SafeStep | None:
    """The largest surely stable step, for most scenes within 1 % below the critical one.

    It holds all forces of the state, at rest. Loads that may be at work later, such as contact,
    enter by the rates that they declare, and so does damping.

    Args:
        dynamics: any equation of motion.
        integrator: its stability limit.
        state: linearisation point.
        near: a shape (n, d) near the fastest vibration, from a state before; the answer is then
            sooner there, and within 2 %.

    Returns:
        None where nothing vibrates: nothing is free, or forces do not grow with displacements; and
        where forces are not finite or cannot be formed.
    """
    if not dynamics.free.any():
        return None
    try:
        response = LinearResponse.about(dynamics, state)
        start = np.random.default_rng(state.step).standard_normal(len(response.roots))
        least, gap = _LEAST, _GAP
        if near is not None:
            least, gap = _LEAST_AGAIN, _GAP_AGAIN
            known = response.scaled(near)
            size = float(np.sqrt(np.einsum("i,i->", known, known)))
            start += known * (sqrt(len(known)) / size if size > 0.0 else 0.0)
        found = spectral_bound(response.times, start, least=least, most=_MOST, gap=gap)
    except BuildError:  # moving neighbours may not determine a gradient
        return None
    if found is None or not 0.0 < found.bound < np.inf:
        return None
    step = stable_step_of(_MARGIN * found.bound, integrator, dynamics.loads)
    return SafeStep(step, response.shape(found.vector))


def stable_step_of(square: float, integrator: Integrator, loads: Iterable[Load]) -> float:
    """Largest stable step [s] under a square of the highest frequency, from a spectrum [1/s^2].

    Loads add the rates that they declare: of damping, and of stiffness that a state may not show.
    """
    loads = list(loads)
    square += sum(load.stiffness_rate**2 for load in loads if not load.acts_always)
    return integrator.stable_step(sqrt(square), sum(load.damping_rate for load in loads))
