"""Checks of an effect, on free bodies of scattered particles in 1, 2 and 3D.

An effect may refuse a dimension or a formulation; it must not refuse all of them. One that refuses
every single body is given pairs of bodies that touch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import product

import attrs
import numpy as np

from solidsph.assembly.builder import Builder
from solidsph.conformance.check import Broken, Kit, NotPromised, Verdict, at_most, more_than, worst
from solidsph.conformance.samples import DIMENSIONS, accepted, kept_for_last
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.terms import EnergyTerm, Load, Observation
from solidsph.maths.arrays import Array
from solidsph.simulation import Simulation
from solidsph.testing.bodies import SPACING, box, scene, smooth, with_waves
from solidsph.testing.terms import (
    check_report,
    derived_verdict,
    field_verdict,
    force_problem,
    residual,
    stiffness_error,
)

_LABEL = "effect"
_ENERGY = f"{_LABEL} energy [J]"
_CELLS = {1: (12,), 2: (7, 6), 3: (4, 4, 3)}
_COVER = 2.5
# How far two bodies are pressed into each other and moved aside, in spacings.
_PRESSED, _ASIDE = 0.3, 0.35
_FORMS = ("total-lagrangian", "updated-lagrangian")
_SPEED = 37.0  # of the confined wave of the bodies' material [m/s]

_TIME = 1e-3  # at which forces and energies are evaluated [s]

# After so many steps, effects with memory have something in it.
_FIRST_STEPS = 4

# Sums that cancel pair by pair leave 1e-16; where a force is itself a small difference of large
# terms, as hourglass control's on a smooth motion, 1e-12 of it.
_CANCELLATION = 1e-11

KIT = Kit()


@attrs.frozen(eq=False)
class _Sample:
    """A free body at rest that the effect accepts."""

    simulation: Simulation
    rng: np.random.Generator
    memory: Mapping[str, Array]  # after the body's first steps
    engines: list[InternalForces] = attrs.field(factory=list)  # without the effect, once needed

    @property
    def load(self) -> Load:
        (load,) = [load for load in self.simulation.dynamics.loads if load.label == _LABEL]
        return load

    @property
    def positions(self) -> Array:
        """At the start, (n, d) [m]."""
        return self.simulation.initial.positions

    def smooth(self) -> Array:
        """A smooth displacement (n, d) [m]."""
        length = max(_CELLS[self.positions.shape[1]]) * SPACING
        return smooth(self.rng, self.positions, length, 0.02)

    def forces(self, positions: Array, velocities: Array, time: float = _TIME) -> Array:
        """Forces of the effect on all particles, (n, d) [N]."""
        f = np.zeros_like(positions)
        force, _ = self.load.advance(time, 0.0, positions, velocities, self.memory)
        f[self.load.particles] = force
        if self.acts_within:
            f += self.internal(time, positions) - self.plain(time, positions)
        return f

    @property
    def acts_within(self) -> bool:
        """Whether the effect changes the internal forces."""
        return isinstance(self.load, ForcesModifier)

    def internal(self, time: float, positions: Array) -> Array:
        """Internal forces with the effect, (n, d) [N]."""
        u = positions - self.simulation.particles.positions
        return self.simulation.dynamics.internal.advance(time, 0.0, u, self.memory)[0]

    def plain(self, time: float, positions: Array) -> Array:
        """Internal forces without the effect, (n, d) [N]."""
        if not self.engines:
            prepare = self.simulation.engine.prepare
            self.engines.append(prepare(self.simulation.model.bodies, ()))
        return self.engines[0].forces(time, positions - self.simulation.particles.positions)

    def observed(self, u: Array) -> Observation:
        """The body at rest at displacements u (n, d)."""
        state = attrs.evolve(
            self.simulation.start(),
            time=_TIME,
            positions=self.positions + u,
            memory=dict(self.memory),
        )
        return self.simulation.dynamics.observe(state)

    def energy(self, u: Array) -> float | None:
        """Energy that the effect stores, or else reports, at displacements u (n, d) [J]."""
        observation = self.observed(u)
        if isinstance(self.load, EnergyTerm):
            return float(np.sum(self.load.energies(observation)))
        return self.load.report(observation).get(_ENERGY)


@kept_for_last
def _simulations(effect: Effect) -> list[tuple[Simulation, Mapping[str, Array]]]:
    """Scenes with every body that is not refused, and the memory after its first steps.

    Raises:
        SceneError: all of them are.
    """
    refusal: SceneError | None = None
    for make in (_single, _touching):
        try:
            made = accepted(
                "body",
                (
                    (f"{d}D, {form}", partial(_built, make, effect, d, form))
                    for d, form in product(DIMENSIONS, _FORMS)
                ),
                (BuildError, SceneError),
            )
        except SceneError as cause:
            refusal = refusal or cause
            continue
        begun = [one.time_loop().advance(one.start(), _FIRST_STEPS) for one in made]
        return [(one, state.memory) for one, state in zip(made, begun, strict=True)]
    assert refusal is not None
    raise refusal


def _samples(effect: Effect) -> list[_Sample]:
    """The bodies, each with the same random numbers for every check."""
    return [
        _Sample(simulation, np.random.default_rng(k), memory)
        for k, (simulation, memory) in enumerate(_simulations(effect))
    ]


def _built(
    make: Callable[[int, str], Builder[Simulation]], effect: Effect, d: int, form: str
) -> Simulation:
    return make(d, form).effect(effect, label=_LABEL).build()


def _single(d: int, form: str) -> Builder[Simulation]:
    """One body, without any effect."""
    builder = with_waves(scene(_COVER).formulation(form), d, 1.0, 2e-3)
    return _with_body(builder, "body", d, [0.0] * d)


def _touching(d: int, form: str) -> Builder[Simulation]:
    """Two bodies side by side, pressed together at the start, without any effect."""
    beside = [SPACING * _CELLS[d][0], *[_ASIDE * SPACING] * (d - 1)]
    return _with_body(_single(d, form), "other", d, beside).initial(
        where="other", displacement={"x": -_PRESSED * SPACING}
    )


def _with_body(
    builder: Builder[Simulation], name: str, d: int, origin: list[float]
) -> Builder[Simulation]:
    scattered = {"type": "jittered-lattice", "amplitude": 0.1, "seed": d}
    shape = box(_CELLS[d], origin)
    return builder.body(name, shape=shape, spacing=SPACING, discretisation=scattered)


# This check comes first: if the effect acts on scenes without it, later ones would hide that.
@KIT.problems("the same bits, no account")
def nothing_when_absent(effect: Effect) -> Iterator[str]:
    """A scene without it has no account of it, and runs to the same bits whether or not the effect
    has been used before."""
    for make, d in product((_single, _touching), DIMENSIONS[:2]):
        before = make(d, _FORMS[0]).build()
        expected = before.run().state
        try:
            _built(make, effect, d, _FORMS[0]).run()
        except (BuildError, SceneError):
            continue
        after = make(d, _FORMS[0]).build().run().state
        again = before.run().state
        same = all(np.array_equal(expected.positions, one.positions) for one in (after, again))
        if not same or after.applied:
            yield f"{d}D: a run without it is another, accounts {after.applied}"


@KIT.check
def bound(effect: Effect) -> Verdict:
    """Some body is accepted, any other refused with a remedy; bound, the effect has the label that
    it was given."""
    samples = _samples(effect)
    labels = {effect.bind(sample.simulation.model, _LABEL).label for sample in samples}
    count = f"{len(samples)} of {len(DIMENSIONS) * len(_FORMS)} bodies"
    return Verdict(labels == {_LABEL}, f"{count}, labels {', '.join(sorted(labels))}")


@KIT.problems("as required")
def forces(effect: Effect) -> Iterator[str]:
    """Its forces are one finite vector for each of its particles, which are named once and are no
    ghosts, and depend only on time, positions and velocities."""
    for sample in _samples(effect):
        yield force_problem(sample.simulation, sample.load, sample.smooth())


@KIT.check
def arrays(effect: Effect) -> Verdict:
    """The arrays that it keeps are listed by name, in bytes."""
    listed: set[str] = set()
    for sample in _samples(effect):
        for name, size in sample.load.arrays.items():
            if not isinstance(name, str) or not isinstance(size, (int, np.integer)) or size < 0:
                raise Broken(f"{name!r}: {size!r}")
            listed.add(name)
    return Verdict(True, ", ".join(sorted(listed)) or "none")


@KIT.check
def momentum(effect: Effect) -> Verdict:
    """Its forces on a free body and their moments add up to zero, if and only if declared."""
    errors = []
    for sample in _samples(effect):
        x = sample.positions + sample.smooth()
        f = sample.forces(x, 50.0 * sample.smooth())
        size = float(np.abs(f).sum())
        if size == 0.0:
            raise Broken("there is no force on a body that moves and is deformed")
        moments = x.T @ f
        turn = np.abs(moments - moments.T).max() / (np.abs(x).T @ np.abs(f)).max()
        errors.append(max(float(np.abs(f.sum(axis=0)).max() / size), float(turn)))
    if effect.conserves_momentum:
        return at_most(max(errors), _CANCELLATION)
    # Forces that are not between pairs push the body as a whole, in some dimension.
    return more_than(max(errors), 1e-6)


# The trapezoidal rule over steps of a fortieth of the CFL step leaves its square, 6e-4, of the
# energy that waves of the shortest length exchange.
@KIT.errors(1e-3, none="it refuses formulations with an energy")
def energy_account(effect: Effect) -> Iterator[float]:
    """The energy that a body gains is the work of the effect's account."""
    for sample in _samples(effect):
        # The updated form has no energy of its own.
        if sample.simulation.model.bodies[0].formulation.configuration.value == "reference":
            yield residual(sample.simulation)


@KIT.check
def stored_energy(effect: Effect) -> Verdict:
    """Its force derives from the energy that it stores or reports; its damping only takes
    energy."""
    kept: set[str] = set()
    for sample in _samples(effect):
        if sample.load.damping_rate > 0.0:
            x, v = sample.positions + sample.smooth(), 50.0 * sample.smooth()
            still = sample.forces(x, np.zeros_like(v))
            power = float(np.vdot(sample.forces(x, v) - still, v))
            if power > 0.0:
                raise Broken(f"it damps, but gives {power:.1e} W")
            kept.add("takes energy")
        u = sample.smooth()
        _check_energies(sample, u)
        if sample.energy(u) is None:
            continue
        du = sample.smooth()
        step = 1e-4
        change = [sample.energy(u + sign * step * du) or 0.0 for sign in (-1.0, 1.0)]
        f = sample.forces(sample.positions + u, np.zeros_like(u))
        found, expected = (change[1] - change[0]) / (2.0 * step), -float(np.vdot(f, du))
        error = abs(found - expected) / float(np.abs(f * du).sum())
        if not error <= 1e-6:  # the square of the step, and rounding over it
            raise Broken(f"the force differs from the energy's derivative by {error:.1e}")
        kept.add("force from its energy")
    if not kept:
        raise NotPromised("it stores none")
    return Verdict(True, ", ".join(sorted(kept)))


@KIT.check
def damping_rate(effect: Effect) -> Verdict:
    """No small velocity is damped faster than by the declared rate."""
    return _bounded(effect, _damping, "damping_rate")


@KIT.check
def stiffness_rate(effect: Effect) -> Verdict:
    """No small motion about rest has, by the effect alone, a higher angular frequency than
    declared."""
    return _bounded(effect, lambda sample: np.sqrt(max(_stiffness(sample), 0.0)), "stiffness_rate")


# Differences leave the square of their step, 1e-8, and rounding over it.
@KIT.errors(1e-6, none="it has no stiffness")
def stiffness(effect: Effect) -> Iterator[float]:
    """The stiffness that it tells Newton's method is minus the derivative of its force."""
    for sample in _samples(effect):
        error = stiffness_error(sample.simulation, sample.load, sample.smooth(), sample.smooth())
        if error is not None:
            yield error


@KIT.check
def report(effect: Effect) -> Verdict:
    """Its report has finite numbers in columns "label quantity [unit]"."""
    found: set[str] = set()
    for sample in _samples(effect):
        start = sample.simulation.dynamics.observe(sample.simulation.start())
        columns = sample.load.report(start)
        check_report(_LABEL, columns)
        found |= set(columns)
    return Verdict(True, ", ".join(sorted(found)) or "nothing to report")


@KIT.check
def fields(effect: Effect) -> Verdict:
    """Its fields are finite numbers, vectors or tensors of all particles, "quantity [unit]", the
    same ones at all times."""
    return worst([field_verdict(one.simulation, [one.load]) for one in _samples(effect)])


@KIT.check
def derived(effect: Effect) -> Verdict:
    """What a compilable kind derives from its arrays and its formula is not overridden by a method,
    which a compiled loop would not call."""
    return derived_verdict(sample.load for sample in _samples(effect))


def _check_energies(sample: _Sample, u: Array) -> None:
    """Raise Broken if stored energies are not one finite number a particle, or are not those
    reported."""
    if not isinstance(sample.load, EnergyTerm):
        return
    observation = sample.observed(u)
    energies = sample.load.energies(observation)
    count = sample.simulation.particles.count
    if np.shape(energies) != (count,) or not np.all(np.isfinite(energies)):
        raise Broken(f"energies {np.shape(energies)} for {count} particles, or not finite")
    reported = sample.load.report(observation).get(_ENERGY)
    total = float(np.sum(energies))
    if reported is not None and abs(reported - total) > 1e-9 * abs(total):
        raise Broken(f"it reports {reported:.6g} J, and stores {total:.6g} J")


def _bounded(effect: Effect, measure: Callable[[_Sample], float], declared: str) -> Verdict:
    """Whether what is measured in each body is at most the declared rate [1/s]."""
    excess, compared = [], []
    for sample in _samples(effect):
        rate, found = getattr(sample.load, declared), float(measure(sample))
        compared.append(f"{found:.3g} of {rate:.3g}")
        # Differences, and an estimate of the largest eigenvalue from below, each leave some 1e-6 of
        # the scale, that of the fastest waves.
        excess.append((found - rate) / (_SPEED / SPACING))
    largest = int(np.argmax(excess))
    return Verdict(bool(excess[largest] <= 1e-5), f"{compared[largest]} 1/s")


def _damping(sample: _Sample) -> float:
    """Largest rate at which small velocities decay, where all neighbours approach [1/s]."""
    x = sample.positions
    # Slow, so that terms linear in velocity dominate, yet faster than the differences.
    approach = -1e-3 * _SPEED * (x - x.mean(axis=0)) / float(np.ptp(x))
    return _largest(sample, lambda v: sample.forces(x, approach + v), 1e-6 * _SPEED)


def _stiffness(sample: _Sample) -> float:
    """Largest square of an angular frequency about rest [1/s^2]: of the effect's own forces, or
    by how much it raises that of the internal ones."""
    x, tiny = sample.positions, 1e-4 * SPACING
    still = np.zeros_like(x)
    if sample.acts_within:
        changed = _largest(sample, lambda u: sample.internal(0.0, x + u), tiny)
        return changed - _largest(sample, lambda u: sample.plain(0.0, x + u), tiny)
    return _largest(sample, lambda u: sample.forces(x + u, still), tiny)


def _largest(sample: _Sample, forces: Callable[[Array], Array], step: float) -> float:
    """Minus the smallest real part of the eigenvalues of the accelerations' derivative, by
    differences over `step` along every coordinate."""
    n, d = sample.positions.shape
    masses = sample.simulation.model.masses[:, None]
    columns = []
    for k in range(n * d):
        change = np.zeros(n * d)
        change[k] = step
        moved = change.reshape(n, d)
        columns.append(((forces(moved) - forces(-moved)) / (2.0 * step * masses)).ravel())
    return float(-np.linalg.eigvals(np.column_stack(columns)).real.min())
