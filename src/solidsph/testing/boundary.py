"""What every boundary handler must keep, on boxes with and without ghosts, in 1, 2 and 3D.

A handler may refuse a body that it does not fit, such as one without ghosts; it must not refuse
all of them. It acts on the face "left", if it is told where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import attrs
import numpy as np

from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.terms import (
    Constraint,
    FieldTerm,
    GhostConstraint,
    Load,
    Observation,
    StressTerm,
    Term,
)
from solidsph.maths.arrays import Array, Mask
from solidsph.promises.check import Check, Verdict, at_most, check, not_promised, worst
from solidsph.promises.derived import overridden
from solidsph.promises.samples import DIMENSIONS, made_once
from solidsph.run.energy import kinetic_energy, ledger, strain_energy
from solidsph.simulation import Simulation

_LABEL = "handler"
_CELLS = {1: (12,), 2: (8, 5), 3: (5, 4, 4)}
_SPACING = 0.1  # [m]
_COVER = 2.5
_LAYERS = 3  # of ghosts: as many as the cover reaches
_MATERIAL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}

# Divergence, layers of ghosts, and whether another handler moves them.
_ARRANGEMENTS = (
    ("variational", 0, False),
    ("variational", _LAYERS, False),
    ("variational", _LAYERS, True),
    ("plain", _LAYERS, True),
)

# Linear systems of boundary values may be badly conditioned; what they solve is a promise all the
# same, to half of the digits.
_SOLVED = 1e-8


@attrs.frozen(eq=False)
class _Sample:
    """A body that the handler accepts."""

    simulation: Simulation
    rng: np.random.Generator

    @property
    def adjoint(self) -> bool:
        """Whether the forces have an energy."""
        return self.simulation.model.bodies[0].formulation.divergence.adjoint

    @property
    def conditions(self) -> Sequence[Term]:
        return [one for one in self.simulation.terms if one.label == _LABEL]

    @property
    def motions(self) -> Sequence[Constraint]:
        return [one for one in self.conditions if isinstance(one, Constraint)]

    @property
    def shape(self) -> tuple[int, ...]:
        return self.simulation.particles.positions.shape

    def random(self) -> Array:
        """Displacements (n, d) of a thousandth of a spacing [m]."""
        return np.asarray(1e-3 * _SPACING * self.rng.normal(size=self.shape))


@made_once
def _simulations(handler: BoundaryHandler) -> list[Simulation]:
    """Every body that is not refused.

    Raises:
        SceneError: all of them are.
    """
    found: list[Simulation] = []
    refusals: list[str] = []
    for d, arrangement in product(DIMENSIONS, _ARRANGEMENTS):
        try:
            found.append(_simulation(handler, d, *arrangement))
        except (BuildError, SceneError) as refusal:
            refusals.append(f"{d}D, {arrangement[1]} layers of ghosts: {refusal}")
    if not found:
        raise SceneError(f"every body is refused; the first, {refusals[0]}")
    return found


def _samples(handler: BoundaryHandler) -> list[_Sample]:
    """The bodies, each with the same random numbers for every check."""
    return [_Sample(one, np.random.default_rng(k)) for k, one in enumerate(_simulations(handler))]


def _simulation(
    handler: BoundaryHandler, d: int, divergence: str, layers: int, extended: bool
) -> Simulation:
    lattice: dict[str, Any] = {"type": "lattice", "on_boundary": True}
    if layers:
        lattice |= {"ghosts": layers, "ghost_faces": ["left"]}
    builder = (
        Simulation.builder()
        .body(
            "body",
            shape={"type": "box", "lengths": [_SPACING * count for count in _CELLS[d]]},
            spacing=_SPACING,
            discretisation=lattice,
        )
        .kernel("modified-mollifier", cover=_COVER)
        .material("neo-hookean", **_MATERIAL)
        .formulation("total-lagrangian", divergence=divergence)
        .boundary(handler, label=_LABEL)
        # Waves and not a rigid motion, small enough for any face to stand.
        .initial(velocity={axis: f"0.1*sin({3 + k}*X+{k})" for k, axis in enumerate("xyz"[:d])})
        .integrator("central-difference", time_step_factor=0.025)
        .engine("matrix")
        .duration(4e-3)
        .outputs(2)
    )
    if extended:
        builder.boundary("ghost-extension", label="extension")
    return builder.build()


@check
def conditions(handler: BoundaryHandler) -> Verdict:
    """Some body is accepted, any other refused with a remedy; bound, the handler is one condition
    or more under the label that it was given."""
    for sample in _samples(handler):
        bound = handler.bind(sample.simulation.model, _LABEL)
        if not bound or any(one.label != _LABEL for one in bound):
            return Verdict(False, f"{[(type(one).__name__, one.label) for one in bound]}")
    kinds = {type(one).__name__ for one in bound}
    return Verdict(True, ", ".join(sorted(kinds)))


@check
def held_only(handler: BoundaryHandler) -> Verdict:
    """What it imposes on motion are the freedoms that it holds, to the last bit no others, and to
    impose it twice is to impose it once."""
    errors, acts = [0.0], False
    for sample, motion in _of_motion(handler):
        acts = True
        for derivative in (0, 1, 2):
            free = sample.random()
            once = _imposed(motion, 1e-3, derivative, free)
            if not np.array_equal(once[~motion.held], free[~motion.held]):
                return Verdict(False, f"derivative {derivative}: a free entry was changed")
            twice = _imposed(motion, 1e-3, derivative, once)
            errors.append(float(np.abs(twice - once).max() / max(np.abs(once).max(), 1e-300)))
    return at_most(max(errors), _SOLVED) if acts else not_promised("it imposes no motion")


@check
def rates(handler: BoundaryHandler) -> Verdict:
    """Its velocity is the derivative of its displacement by time, its acceleration that of its
    velocity, whatever the free motion."""
    errors, acts = [0.0], False
    time, step = 2e-3, 1e-5
    for sample, motion in _of_motion(handler):
        acts = True
        # The free motion u + v t + a t^2 / 2 and its derivatives.
        u, v, a = sample.random(), sample.random() / 1e-3, sample.random() / 1e-6
        for derivative in (1, 2):
            before, after = (
                _imposed(
                    motion,
                    t,
                    derivative - 1,
                    u + v * t + 0.5 * a * t**2 if derivative == 1 else v + a * t,
                )
                for t in (time - step, time + step)
            )
            found = _imposed(motion, time, derivative, v + a * time if derivative == 1 else a)
            error = np.abs(found - (after - before) / (2.0 * step)).max()
            errors.append(float(error / np.abs(found).max()))
    # A handler may take derivatives of a formula by differences over a step of the run, which err
    # by its square: of a motion of 300 rad/s in steps of 0.1 ms, some 1e-4.
    return at_most(max(errors), 1e-3) if acts else not_promised("it imposes no motion")


@check
def virtual_power(handler: BoundaryHandler) -> Verdict:
    """Forces on ghosts are handed on such that they do the same work: the transpose of the ghosts'
    motion, with nothing left on ghosts."""
    errors, acts = [0.0], False
    for sample, motion in _of_motion(handler):
        if not isinstance(motion, GhostConstraint):
            continue
        acts = True
        ghosts = sample.simulation.particles.ghosts[:, None]
        u, f = sample.random(), np.where(ghosts, sample.random(), 0.0)
        du = np.where(motion.held, 0.0, sample.random())
        placed = _imposed(motion, 0.0, 0, u + du) - _imposed(motion, 0.0, 0, u)
        returned = f.copy()
        motion.return_forces(returned)
        scale = float(np.abs(f * placed).sum())
        errors.append(abs(float(np.vdot(f, placed) - np.vdot(returned, du))) / scale)
        left = np.abs(returned[ghosts & motion.held]).max(initial=0.0)
        errors.append(float(left / np.abs(f).max()))
    return at_most(max(errors), _SOLVED) if acts else not_promised("no ghosts follow it")


@check
def stresses(handler: BoundaryHandler) -> Verdict:
    """Stresses that it imposes are finite, and those of ghosts and of particles on the surface:
    the others keep theirs to the last bit."""
    acts = False
    for sample in _samples(handler):
        particles = sample.simulation.particles
        inside = ~particles.ghosts & ~np.any(particles.area_vectors != 0.0, axis=1)
        for condition in sample.conditions:
            if not isinstance(condition, StressTerm):
                continue
            acts = True
            d = particles.dimension
            stress = 1e3 * sample.rng.normal(size=(d, d, particles.count))
            before = stress.copy()
            condition.impose_stress(1e-3, stress)
            if not np.array_equal(stress[:, :, inside], before[:, :, inside]):
                return Verdict(False, "the stress of a particle inside was changed")
            if not np.all(np.isfinite(stress)):
                return Verdict(False, "a stress is not finite")
    return Verdict(True, "as required") if acts else not_promised("it imposes no stress")


@check
def forces(handler: BoundaryHandler) -> Verdict:
    """Forces that it adds are one finite vector for each of its particles, which are named once
    and are no ghosts, and depend on nothing but time, positions and velocities."""
    acts = False
    for sample in _samples(handler):
        for condition in sample.conditions:
            if not isinstance(condition, Load):
                continue
            acts = True
            problem = force_problem(sample.simulation, condition, sample.random())
            if problem:
                return Verdict(False, problem)
    return Verdict(True, "as required") if acts else not_promised("it adds no force")


@check
def report(handler: BoundaryHandler) -> Verdict:
    """Its report has finite numbers in columns "label quantity [unit]", the same at all times."""
    found: set[str] = set()
    for sample in _samples(handler):
        reports = [
            [one.report(observation) for one in sample.conditions]
            for observation in _observed(sample.simulation)
        ]
        columns = [[sorted(one) for one in several] for several in reports]
        if any(one != columns[0] for one in columns):
            return Verdict(False, f"columns {columns[0]}, then others")
        for several in reports:
            problem = report_problem(_LABEL, several)
            if problem:
                return Verdict(False, problem)
            found |= {name for one in several for name in one}
    return Verdict(True, ", ".join(sorted(found)) or "nothing to report")


@check
def fields(handler: BoundaryHandler) -> Verdict:
    """Fields that it shows are finite numbers, vectors or tensors of all particles, "quantity
    [unit]", the same ones at all times."""
    return worst([field_verdict(one.simulation, one.conditions) for one in _samples(handler)])


@check
def derived(handler: BoundaryHandler) -> Verdict:
    """What a declared kind derives from its arrays and its formula is not said otherwise by a
    method, which a compiled loop does not call."""
    problems = [overridden(one) for sample in _samples(handler) for one in sample.conditions]
    problem = next(filter(None, problems), "")
    return Verdict(not problem, problem or "nothing is overridden")


@check
def energy_account(handler: BoundaryHandler) -> Verdict:
    """What the body gains is the work of the handler's account, where forces have an energy."""
    errors = [residual(sample.simulation) for sample in _samples(handler) if sample.adjoint]
    if not errors:
        return not_promised("the divergence that it needs is not the adjoint")
    # The trapezoidal rule over steps of a fortieth of the CFL step leaves its square, 6e-4, of what
    # waves of the shortest length exchange, and less of longer ones.
    return at_most(max(errors), 1e-3)


CHECKS: tuple[Check, ...] = (
    conditions,
    held_only,
    rates,
    virtual_power,
    stresses,
    forces,
    report,
    fields,
    derived,
    energy_account,
)


def _of_motion(handler: BoundaryHandler) -> Iterator[tuple[_Sample, Constraint]]:
    for sample in _samples(handler):
        for motion in sample.motions:
            yield sample, motion


def _imposed(motion: Constraint, time: float, derivative: int, free: Array) -> Array:
    values = free.copy()
    motion.impose(time, derivative, values)
    return values


def _observed(simulation: Simulation) -> Iterator[Observation]:
    """The start and the states at the outputs, step by step."""
    state = simulation.start()
    yield simulation.dynamics.observe(state)
    loop = simulation.time_loop()
    for stop in simulation.output_steps():
        state = loop.advance(state, stop)
        yield simulation.dynamics.observe(state)


def residual(simulation: Simulation) -> float:
    """What the energy ledger leaves at the end of a run, over the most energy that moved in it."""
    first, *others = list(_observed(simulation))
    start = kinetic_energy(first) + strain_energy(first)
    accounts = [ledger(one, start) for one in others]
    moved = max(start, *(max(map(abs, one.values())) for one in accounts))
    return max(abs(one["energy residual [J]"]) for one in accounts) / moved


def force_problem(simulation: Simulation, condition: Load, u: Array) -> str:
    """What is wrong with the forces of a condition at displacements `u` (n, d); nothing if all is
    well."""
    particles = simulation.particles
    x, v = simulation.initial.positions + u, 1e2 * u[::-1]
    chosen = np.asarray(condition.particles)
    before = x.copy(), v.copy()
    f = condition.forces(1e-3, x, v)
    # Of many distinct times: a part that remembers when it was asked last would show.
    condition.forces(2e-3, x, v)
    again = condition.forces(1e-3, x, v)
    ghosts: Mask = particles.ghosts[chosen]
    problems = {
        f"forces {np.shape(f)} for {len(chosen)} particles": f.shape
        != (len(chosen), particles.dimension),
        "a force is not finite": not np.all(np.isfinite(f)),
        "a particle is named twice": len(np.unique(chosen)) != len(chosen),
        "a ghost is pushed": bool(ghosts.any() and np.any(f[ghosts] != 0.0)),
        "positions or velocities were changed": not (
            np.array_equal(before[0], x) and np.array_equal(before[1], v)
        ),
        "the same question got another answer": not np.array_equal(f, again),
    }
    return "; ".join(problem for problem, present in problems.items() if present)


def field_verdict(simulation: Simulation, conditions: Sequence[Term]) -> Verdict:
    """Whether the fields of `conditions` are such as a record can hold."""
    shown = [one for one in conditions if isinstance(one, FieldTerm)]
    if not shown:
        return not_promised("it shows no field")
    n, d = simulation.particles.positions.shape
    names: list[set[str]] = []
    for observation in _observed(simulation):
        found = {name: a for one in shown for name, a in one.fields(observation).items()}
        for name, values in found.items():
            if not (name.endswith("]") and " [" in name):
                return Verdict(False, f"field {name!r}")
            if np.shape(values) not in ((n,), (n, d), (n, d, d)) or not np.all(np.isfinite(values)):
                return Verdict(False, f"{name} {np.shape(values)} of {n} particles, or not finite")
        names.append(set(found))
    if any(one != names[0] for one in names):
        return Verdict(False, f"{sorted(names[0])}, then others")
    return Verdict(True, ", ".join(sorted(names[0])) or "none")


def report_problem(label: str, reports: Sequence[Any]) -> str:
    """What is wrong with reports of conditions called `label`; nothing if all is well."""
    for one in reports:
        for name, value in one.items():
            if not (name.startswith(f"{label} ") and name.endswith("]") and " [" in name):
                return f"column {name!r}"
            if not np.isfinite(value):
                return f"{name} = {value}"
    return ""
