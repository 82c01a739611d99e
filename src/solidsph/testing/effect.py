"""What every effect must keep, on free bodies of scattered particles in 1, 2 and 3D.

An effect may refuse a dimension or a formulation; it must not refuse all of them. One that refuses
every single body is put to pairs of bodies that touch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product
from typing import Any

import attrs
import numpy as np

from solidsph.assembly.builder import Builder
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.terms import EnergyTerm, Load, Observation
from solidsph.maths.arrays import Array
from solidsph.promises.check import Check, Verdict, at_most, check, more_than, not_promised, worst
from solidsph.promises.derived import overridden
from solidsph.promises.samples import DIMENSIONS, made_once
from solidsph.simulation import Simulation
from solidsph.testing.boundary import field_verdict, force_problem, report_problem, residual

_LABEL = "effect"
_ENERGY = f"{_LABEL} energy [J]"
_CELLS = {1: (12,), 2: (7, 6), 3: (4, 4, 3)}
_SPACING = 0.1  # [m]
_COVER = 2.5
# How far two bodies are pressed into each other and moved aside, in spacings.
_PRESSED, _ASIDE = 0.3, 0.35
_FORMS = ("total-lagrangian", "updated-lagrangian")
_MATERIAL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
_SPEED = 37.0  # of its confined wave [m/s]

_TIME = 1e-3  # at which forces and energies are asked [s]

# After so many, whatever remembers has something to remember.
_FIRST_STEPS = 4

# Sums that cancel pair by pair leave 1e-16; where a force is itself a small difference of large
# terms, as hourglass control's on a smooth motion, 1e-12 of it.
_CANCELLATION = 1e-11


@attrs.frozen(eq=False)
class _Sample:
    """A free body that the effect accepts, at rest and, in another scene, without the effect."""

    simulation: Simulation
    rng: np.random.Generator
    memory: Mapping[str, Array]  # of the body's first steps
    engines: list[InternalForces] = attrs.field(factory=list)  # the plain one, once it is asked for

    @property
    def condition(self) -> Load:
        (one,) = [load for load in self.simulation.dynamics.loads if load.label == _LABEL]
        return one

    @property
    def positions(self) -> Array:
        """At the start, (n, d) [m]."""
        return self.simulation.initial.positions

    def smooth(self) -> Array:
        """A displacement (n, d) of one wave or so, in random directions [m]."""
        d = self.positions.shape[1]
        length = max(_CELLS[d]) * _SPACING
        waves, phases = self.rng.normal(size=(d, d)), self.rng.uniform(0.0, 2.0 * np.pi, d)
        return np.asarray(0.02 * length * np.sin(self.positions @ waves * 3.0 / length + phases))

    def forces(self, positions: Array, velocities: Array, time: float = _TIME) -> Array:
        """On all particles, (n, d) [N]."""
        found = np.zeros_like(positions)
        force, _ = self.condition.advance(time, 0.0, positions, velocities, self.memory)
        found[self.condition.particles] = force
        if self.acts_within:
            found += self.internal(time, positions) - self.plain(time, positions)
        return found

    @property
    def acts_within(self) -> bool:
        """Whether the effect changes the internal forces."""
        return isinstance(self.condition, ForcesModifier)

    def internal(self, time: float, positions: Array) -> Array:
        """Internal forces as the effect lets them act, (n, d) [N]."""
        u = positions - self.simulation.particles.positions
        return self.simulation.dynamics.internal.advance(time, 0.0, u, self.memory)[0]

    def plain(self, time: float, positions: Array) -> Array:
        """Internal forces without it, (n, d) [N]."""
        if not self.engines:
            prepare = self.simulation.engine.prepare
            self.engines.append(prepare(self.simulation.model.bodies, ()))
        return self.engines[0].forces(time, positions - self.simulation.particles.positions)


@made_once
def _simulations(effect: Effect) -> list[tuple[Simulation, Mapping[str, Array]]]:
    """Every body that is not refused, and what it remembers of its first steps.

    Raises:
        SceneError: all of them are.
    """
    refusals: list[str] = []
    for scene in (_scene, _touching):
        found: list[tuple[Simulation, Mapping[str, Array]]] = []
        for d, form in product(DIMENSIONS, _FORMS):
            try:
                made = scene(d, form).effect(effect, label=_LABEL).build()
            except (BuildError, SceneError) as refusal:
                refusals.append(f"{d}D, {form}: {refusal}")
                continue
            begun = made.time_loop().advance(made.start(), _FIRST_STEPS)
            found.append((made, begun.memory))
        if found:
            return found
    raise SceneError(f"every body is refused; the first, {refusals[0]}")


def _samples(effect: Effect) -> list[_Sample]:
    """The bodies, each with the same random numbers for every check."""
    return [
        _Sample(one, np.random.default_rng(k), memory)
        for k, (one, memory) in enumerate(_simulations(effect))
    ]


def _scene(d: int, form: str) -> Builder[Simulation]:
    """One body, without any effect."""
    return _with_body(_empty(d, form), "body", d, [0.0] * d)


def _touching(d: int, form: str) -> Builder[Simulation]:
    """Two bodies that lie on each other, and are pressed together at the start, without any
    effect."""
    beside = [_SPACING * _CELLS[d][0], *[_ASIDE * _SPACING] * (d - 1)]
    return _with_body(_scene(d, form), "other", d, beside).initial(
        where="other", displacement={"x": -_PRESSED * _SPACING}
    )


def _with_body(
    builder: Builder[Simulation], name: str, d: int, origin: list[float]
) -> Builder[Simulation]:
    shape: dict[str, Any] = {
        "type": "box",
        "lengths": [_SPACING * n for n in _CELLS[d]],
        "origin": origin,
    }
    scattered = {"type": "jittered-lattice", "amplitude": 0.1, "seed": d}
    return builder.body(name, shape=shape, spacing=_SPACING, discretisation=scattered)


def _empty(d: int, form: str) -> Builder[Simulation]:
    return (
        Simulation.builder()
        .kernel("modified-mollifier", cover=_COVER)
        .material("neo-hookean", **_MATERIAL)
        .formulation(form)
        .initial(velocity={axis: f"sin({3 + k}*X+{k})" for k, axis in enumerate("xyz"[:d])})
        .integrator("central-difference", time_step_factor=0.025)
        .engine("matrix")
        .duration(2e-3)
        .outputs(2)
    )


@check
def bound(effect: Effect) -> Verdict:
    """Some body is accepted, any other refused with a remedy; bound, the effect has the label that
    it was given."""
    samples = _samples(effect)
    labels = {effect.bind(sample.simulation.model, _LABEL).label for sample in samples}
    told = f"{len(samples)} of {len(DIMENSIONS) * len(_FORMS)} bodies"
    return Verdict(labels == {_LABEL}, f"{told}, labels {', '.join(sorted(labels))}")


@check
def forces(effect: Effect) -> Verdict:
    """Forces are one finite vector for each of its particles, which are named once and are no
    ghosts, and depend on nothing but time, positions and velocities."""
    for sample in _samples(effect):
        problem = force_problem(sample.simulation, sample.condition, sample.smooth())
        if problem:
            return Verdict(False, problem)
    return Verdict(True, "as required")


@check
def arrays(effect: Effect) -> Verdict:
    """The arrays that it keeps are listed by name, in bytes."""
    listed: set[str] = set()
    for sample in _samples(effect):
        for name, size in sample.condition.arrays.items():
            if not isinstance(name, str) or not isinstance(size, (int, np.integer)) or size < 0:
                return Verdict(False, f"{name!r}: {size!r}")
            listed.add(name)
    return Verdict(True, ", ".join(sorted(listed)) or "none")


@check
def momentum(effect: Effect) -> Verdict:
    """Its forces on a free body and their moments add up to zero, if and only if declared."""
    errors = []
    for sample in _samples(effect):
        x = sample.positions + sample.smooth()
        f = sample.forces(x, 50.0 * sample.smooth())
        size = float(np.abs(f).sum())
        if size == 0.0:
            return Verdict(False, "there is no force on a body that moves and is deformed")
        moments = x.T @ f
        turn = np.abs(moments - moments.T).max() / (np.abs(x).T @ np.abs(f)).max()
        errors.append(max(float(np.abs(f.sum(axis=0)).max() / size), float(turn)))
    if effect.conserves_momentum:
        return at_most(max(errors), _CANCELLATION)
    # What is no pair force pushes the body as a whole, in some dimension.
    return more_than(max(errors), 1e-6)


@check
def energy_account(effect: Effect) -> Verdict:
    """What a body gains is the work of the effect's account."""
    # The trapezoidal rule over steps of a fortieth of the CFL step leaves its square, 6e-4, of what
    # waves of the shortest length exchange. The updated form has no energy of its own.
    errors = [
        residual(one.simulation)
        for one in _samples(effect)
        if one.simulation.model.bodies[0].formulation.configuration.value == "reference"
    ]
    return at_most(max(errors), 1e-3) if errors else not_promised("it refuses forms with an energy")


@check
def stored_energy(effect: Effect) -> Verdict:
    """An energy that it stores, or reports, is what its force derives from; what it damps, it only
    takes."""
    told: list[str] = []
    for sample in _samples(effect):
        if sample.condition.damping_rate > 0.0:
            x, v = sample.positions + sample.smooth(), 50.0 * sample.smooth()
            still = sample.forces(x, np.zeros_like(v))
            power = float(np.vdot(sample.forces(x, v) - still, v))
            if power > 0.0:
                return Verdict(False, f"it damps, but gives {power:.1e} W")
            told.append("takes energy")
        u = sample.smooth()
        problem = _energy_problem(sample, u)
        if problem:
            return Verdict(False, problem)
        if _energy(sample, u) is None:
            continue
        du = sample.smooth()
        step = 1e-4
        change = [_energy(sample, u + way * step * du) or 0.0 for way in (-1.0, 1.0)]
        f = sample.forces(sample.positions + u, np.zeros_like(u))
        found, expected = (change[1] - change[0]) / (2.0 * step), -float(np.vdot(f, du))
        error = abs(found - expected) / float(np.abs(f * du).sum())
        if not error <= 1e-6:  # the square of the step, and rounding over it
            return Verdict(False, f"the force differs from the energy's derivative by {error:.1e}")
        told.append("force from its energy")
    return Verdict(True, ", ".join(sorted(set(told)))) if told else not_promised("it stores none")


@check
def damping_rate(effect: Effect) -> Verdict:
    """No small velocity is damped faster than by the declared rate."""
    return _bounded(effect, _damping, "damping_rate")


@check
def stiffness_rate(effect: Effect) -> Verdict:
    """No small motion about rest has, by the effect alone, a higher angular frequency than
    declared."""
    return _bounded(effect, lambda sample: np.sqrt(max(_stiffness(sample), 0.0)), "stiffness_rate")


@check
def report(effect: Effect) -> Verdict:
    """Its report has finite numbers in columns "label quantity [unit]"."""
    found: set[str] = set()
    for sample in _samples(effect):
        observation = sample.simulation.dynamics.observe(sample.simulation.start())
        columns = sample.condition.report(observation)
        problem = report_problem(_LABEL, [columns])
        if problem:
            return Verdict(False, problem)
        found |= set(columns)
    return Verdict(True, ", ".join(sorted(found)) or "nothing to report")


@check
def nothing_when_absent(effect: Effect) -> Verdict:
    """A scene that does not name it has no account of it, and runs to the same bits whether or not
    the effect has been at work before."""
    for scene, d in product((_scene, _touching), DIMENSIONS[:2]):
        before = scene(d, _FORMS[0]).build()
        expected = before.run().state
        try:
            scene(d, _FORMS[0]).effect(effect, label=_LABEL).build().run()
        except (BuildError, SceneError):
            continue
        found = scene(d, _FORMS[0]).build().run().state
        again = before.run().state
        same = all(np.array_equal(expected.positions, one.positions) for one in (found, again))
        if not same or found.applied:
            return Verdict(False, f"{d}D: a run without it is another, accounts {found.applied}")
    return Verdict(True, "the same bits, no account")


@check
def fields(effect: Effect) -> Verdict:
    """Fields that it shows are finite numbers, vectors or tensors of all particles, "quantity
    [unit]", the same ones at all times."""
    return worst([field_verdict(one.simulation, [one.condition]) for one in _samples(effect)])


@check
def derived(effect: Effect) -> Verdict:
    """What a declared kind derives from its arrays and its formula is not said otherwise by a
    method, which a compiled loop does not call."""
    problem = next(filter(None, (overridden(one.condition) for one in _samples(effect))), "")
    return Verdict(not problem, problem or "nothing is overridden")


# The first comes first: later, what it looks for may have happened.
CHECKS: tuple[Check, ...] = (
    nothing_when_absent,
    bound,
    forces,
    arrays,
    momentum,
    energy_account,
    stored_energy,
    damping_rate,
    stiffness_rate,
    report,
    fields,
    derived,
)


def _energy(sample: _Sample, u: Array) -> float | None:
    """What the effect stores, or else reports as its energy, at displacements u (n, d) [J]."""
    observation = _observed(sample, u)
    if isinstance(sample.condition, EnergyTerm):
        return float(np.sum(sample.condition.energies(observation)))
    return sample.condition.report(observation).get(_ENERGY)


def _energy_problem(sample: _Sample, u: Array) -> str:
    """What is wrong with the energies as such; nothing if all is well or there are none."""
    if not isinstance(sample.condition, EnergyTerm):
        return ""
    observation = _observed(sample, u)
    energies = sample.condition.energies(observation)
    count = sample.simulation.particles.count
    if np.shape(energies) != (count,) or not np.all(np.isfinite(energies)):
        return f"energies {np.shape(energies)} for {count} particles, or not finite"
    told = sample.condition.report(observation).get(_ENERGY)
    total = float(np.sum(energies))
    if told is not None and abs(told - total) > 1e-9 * abs(total):
        return f"it reports {told:.6g} J, and stores {total:.6g} J"
    return ""


def _observed(sample: _Sample, u: Array) -> Observation:
    simulation = sample.simulation
    state = attrs.evolve(
        simulation.start(), time=_TIME, positions=sample.positions + u, memory=dict(sample.memory)
    )
    return simulation.dynamics.observe(state)


def _bounded(effect: Effect, measure: Callable[[_Sample], float], declared: str) -> Verdict:
    excess, told = [], []
    for sample in _samples(effect):
        rate, found = getattr(sample.condition, declared), float(measure(sample))
        told.append(f"{found:.3g} of {rate:.3g}")
        # Differences, and an estimate of the largest eigenvalue from below, each leave some 1e-6 of
        # the scale, that of the fastest waves.
        excess.append((found - rate) / (_SPEED / _SPACING))
    worst = int(np.argmax(excess))
    return Verdict(bool(excess[worst] <= 1e-5), f"{told[worst]} 1/s")


def _damping(sample: _Sample) -> float:
    """Largest rate at which small velocities fall, where all neighbours approach [1/s]."""
    x = sample.positions
    # Slow, so that what is linear in velocity decides, yet faster than the differences.
    approach = -1e-3 * _SPEED * (x - x.mean(axis=0)) / float(np.ptp(x))
    matrix = _derivative(sample, lambda v: sample.forces(x, approach + v), 1e-6 * _SPEED)
    return float(-np.linalg.eigvals(matrix).real.min())


def _stiffness(sample: _Sample) -> float:
    """Largest square of an angular frequency about rest [1/s^2]: of the effect's own forces, or
    how much it raises that of the internal ones."""
    x, tiny = sample.positions, 1e-4 * _SPACING
    still = np.zeros_like(x)
    if sample.acts_within:
        with_it, without = (
            -np.linalg.eigvals(_derivative(sample, one, tiny)).real.min()
            for one in (
                lambda u: sample.internal(0.0, x + u),
                lambda u: sample.plain(0.0, x + u),
            )
        )
        return float(with_it - without)
    matrix = _derivative(sample, lambda u: sample.forces(x + u, still), tiny)
    return float(-np.linalg.eigvals(matrix).real.min())


def _derivative(sample: _Sample, forces: Callable[[Array], Array], step: float) -> Array:
    """Accelerations by one coordinate after another, (n d, n d)."""
    n, d = sample.positions.shape
    masses = sample.simulation.model.masses[:, None]
    columns = []
    for k in range(n * d):
        change = np.zeros(n * d)
        change[k] = step
        moved = change.reshape(n, d)
        columns.append(((forces(moved) - forces(-moved)) / (2.0 * step * masses)).ravel())
    return np.column_stack(columns)
