"""Checks of an integrator, on one mass and one spring."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from math import atan2, cos, exp, hypot, log, sin, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.conformance.check import Broken, Kit, Verdict, at_most, more_than
from solidsph.conformance.derived import overridden
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Constraint, Load, Observation
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles, State
from solidsph.run.dynamics import Dynamics

_MASS = 2.0  # [kg]
_FREQUENCY = 3.0  # omega [rad/s]
_RATE = 0.6  # damping rate c / m [1/s]
_START, _SPEED = 1.0, 1.5  # [m], [m/s]

# Numbers of steps in 5/6 of a period: the coarsest resolves it, the finest stays clear of
# rounding up to the sixth order.
_STEPS = (40, 80, 160, 320)
_DURATION = 2.0 * np.pi / _FREQUENCY * 5.0 / 6.0  # [s]

# A fitted slope differs from the order by about the relative size of the next term of the error,
# (omega dt)^2 at the coarsest steps.
_ORDER_TOLERANCE = 0.1

KIT = Kit()


@final
@attrs.frozen(eq=False)
class _Spring(InternalForces):
    """f = -m omega^2 u on every particle."""

    @property
    def pair_count(self) -> int:
        return 0

    def forces(self, time: float, displacements: Array) -> Array:
        return -_MASS * _FREQUENCY**2 * displacements

    def fields(self, displacements: Array) -> StressFields:
        n, d = displacements.shape
        return StressFields(np.tile(np.eye(d), (n, 1, 1)), np.zeros((n, d, d)), np.zeros(n))

    def gradients(self, displacements: Array) -> Array:
        n, d = displacements.shape
        return np.zeros((n, d, d))

    def spread(self, displacements: Array, stress: Array) -> Array:
        return np.zeros_like(displacements)


@final
@attrs.frozen(eq=False)
class _Damper(Load):
    """f = -c v on the first particle."""

    label: str = "damper"
    rate: float = _RATE  # c over the mass [1/s]

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}

    @property
    def particles(self) -> Indices:
        return np.array([0])

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -_MASS * self.rate * velocities[:1]


@final
@attrs.frozen(eq=False)
class _Shaker(Constraint):
    """u = sin t of the first particle."""

    label: str = "shaker"

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}

    @property
    def held(self) -> Mask:
        return np.array([[True]])

    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        values[0] = (sin(time), cos(time), -sin(time))[derivative]


def _dynamics(*terms: _Damper | _Shaker) -> Dynamics:
    """One particle at X = 0."""
    origin, unit = np.zeros((1, 1)), np.ones(1)
    particles = Particles(
        positions=origin,
        volumes=unit,
        spacings=unit,
        area_vectors=origin,
        ghosts=np.array([False]),
        images=origin,
    )
    return Dynamics(
        particles=particles,
        masses=_MASS * unit,
        internal=_Spring(),
        constraints=[term for term in terms if isinstance(term, _Shaker)],
        loads=[term for term in terms if isinstance(term, _Damper)],
        step_size=1.0,  # no motion here is a difference over it
    )


def _initial(position: float = _START, velocity: float = _SPEED) -> State:
    return State(
        time=0.0,
        step=0,
        positions=np.array([[position]]),
        velocities=np.array([[velocity]]),
        accelerations=np.zeros((1, 1)),
    )


def _run(
    integrator: Integrator,
    dynamics: Dynamics,
    step_size: float,
    steps: int,
    initial: State | None = None,
) -> Iterator[State]:
    """The states at the start and after each step."""
    state = integrator.start(initial or _initial(), dynamics, step_size)
    yield state
    for _ in range(steps):
        state = integrator.advance(state, dynamics, step_size)
        yield state


def _last(integrator: Integrator, dynamics: Dynamics, steps: int) -> State:
    """The state after the whole duration."""
    *_, state = _run(integrator, dynamics, _DURATION / steps, steps)
    return state


@KIT.check
def derived(integrator: Integrator) -> Verdict:
    """What two formulas define is not overridden by a method, which a compiled loop would not
    call."""
    problem = overridden(integrator)
    return Verdict(not problem, problem or "nothing is overridden")


@KIT.check
def order(integrator: Integrator) -> Verdict:
    """In a free oscillation the error falls with the declared order."""
    return _order(integrator, _dynamics(), 0.0)


@KIT.check
def order_with_damping(integrator: Integrator) -> Verdict:
    """With a force that depends on velocity the error falls with the declared order too."""
    return _order(integrator, _dynamics(_Damper()), _RATE)


@KIT.check
def stable_below_limit(integrator: Integrator) -> Verdict:
    """At 0.99 of the declared stability limit, which is positive, an oscillation stays bounded."""
    if not integrator.stability_limit > 0.0:
        raise Broken(f"declares stability_limit = {integrator.stability_limit}")
    # So near the limit an amplitude grows by 1 / sqrt(1 - 0.99^2) = 7 before it turns.
    return at_most(_largest(integrator, 0.99 * integrator.stability_limit), 100.0)


@KIT.check
def unstable_above_limit(integrator: Integrator) -> Verdict:
    """At 1.01 of the declared stability limit it grows: the limit is not too low."""
    return more_than(_largest(integrator, 1.01 * integrator.stability_limit), 1e5)


@KIT.check
def stable_with_damping(integrator: Integrator) -> Verdict:
    """At 0.99 of the step that it calls stable an oscillation stays bounded, however damped."""
    worst = 0.0
    for share in (0.3, 1.0, 3.0, 10.0, 30.0):
        rate = share * _FREQUENCY
        step = 0.99 * integrator.stable_step(_FREQUENCY, rate)
        worst = max(worst, _largest(integrator, step * _FREQUENCY, _Damper(rate=rate)))
    return at_most(worst, 100.0)


# They are overwritten, so nothing but the sum X + u may round.
@KIT.errors(1e-15)
def imposed_motion(integrator: Integrator) -> Iterator[float]:
    """A particle whose motion is imposed follows it, in position and velocity."""
    _, *after = _run(integrator, _dynamics(_Shaker()), 0.01, 100, _initial(0.0, 1.0))
    for state in after:
        yield abs(state.positions[0, 0] - sin(state.time))
        yield abs(state.velocities[0, 0] - cos(state.time))


# The trapezoidal rule and a scheme of the first order leave omega dt = 1e-3 of the energy.
@KIT.errors(5e-3)
def work_of_loads(integrator: Integrator) -> Iterator[float]:
    """The work of a load is accounted for: the energy that a damper takes is the energy lost."""
    state = _last(integrator, _dynamics(_Damper()), 4000)
    before = _energy(_initial())
    yield abs(before - _energy(state) + state.work["damper"]) / before


@KIT.check
def bookkeeping(integrator: Integrator) -> Verdict:
    """A step adds 1 to the count and its size to the time, and does not change the old state."""
    dynamics, step_size = _dynamics(), 0.01
    first = _initial()
    started = integrator.start(first, dynamics, step_size)
    untouched = deepcopy(started)
    after = integrator.advance(started, dynamics, step_size)
    again = integrator.advance(started, dynamics, step_size)
    problems = {
        "start counts as a step": started.step != 0 or started.time != 0.0,
        "the count is wrong": after.step != 1,
        "the time is wrong": after.time != step_size,
        "the initial state was changed": not _same(first, _initial()),
        "the old state was changed": not _same(started, untouched),
        "the same step gave another result": not _same(after, again),
    }
    found = [problem for problem, present in problems.items() if present]
    return Verdict(not found, "; ".join(found) or "as required")


def _fitted_order(integrator: Integrator, dynamics: Dynamics, rate: float) -> float:
    """Slope of log error against log step for u'' + 2 g u' + omega^2 u = 0 with 2 g = rate."""
    g = 0.5 * rate
    omega = sqrt(_FREQUENCY**2 - g**2)
    amplitude = hypot(_START, (_SPEED + g * _START) / omega)
    phase = atan2((_SPEED + g * _START) / omega, _START)
    decay = amplitude * exp(-g * _DURATION)
    angle = omega * _DURATION - phase
    u, v = decay * cos(angle), -decay * (g * cos(angle) + omega * sin(angle))
    errors = []
    for steps in _STEPS:
        end = _last(integrator, dynamics, steps)
        position, velocity = end.positions[0, 0], end.velocities[0, 0]
        errors.append(log(hypot(position - u, (velocity - v) / _FREQUENCY)))
    return float(np.polyfit(-np.log(_STEPS), errors, 1)[0])


def _order(integrator: Integrator, dynamics: Dynamics, rate: float) -> Verdict:
    fitted = _fitted_order(integrator, dynamics, rate)
    passed = abs(fitted - integrator.order) <= _ORDER_TOLERANCE
    return Verdict(passed, f"{fitted:.3f} (declared {integrator.order})")


def _largest(integrator: Integrator, product: float, *terms: _Damper) -> float:
    """Largest |u| over 2000 steps with omega dt = `product`, up to a million."""
    largest = 0.0
    for state in _run(integrator, _dynamics(*terms), product / _FREQUENCY, 2000):
        largest = max(largest, float(abs(state.positions[0, 0])))
        if not largest < 1e6:
            break
    return largest


def _energy(state: State) -> float:
    u, v = state.positions[0, 0], state.velocities[0, 0]
    return float(0.5 * _MASS * (v**2 + (_FREQUENCY * u) ** 2))


def _arrays(state: State) -> list[Array]:
    mappings = (state.memory, state.applied)
    return [
        state.positions,
        state.velocities,
        state.accelerations,
        *(array for mapping in mappings for _, array in sorted(mapping.items())),
    ]


def _same(first: State, second: State) -> bool:
    pairs = zip(_arrays(first), _arrays(second), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)
