"""Checks of a boundary handler, on boxes with and without ghosts, in 1, 2 and 3D.

A handler may refuse a body that it does not fit, such as one without ghosts; it must not refuse
all of them. One that has a `where` acts on the face "left".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any

import attrs
import numpy as np

from solidsph.conformance.check import Broken, Kit, Verdict, worst
from solidsph.conformance.samples import DIMENSIONS, accepted, kept_for_last
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.terms import Constraint, GhostConstraint, Load, StressTerm, Term
from solidsph.maths.arrays import Array
from solidsph.simulation import Simulation
from solidsph.testing.bodies import SPACING, box, scene, with_waves
from solidsph.testing.terms import (
    check_report,
    derived_verdict,
    field_verdict,
    force_problem,
    observed,
    residual,
    stiffness_error,
)

_LABEL = "handler"
_CELLS = {1: (12,), 2: (8, 5), 3: (5, 4, 4)}
_COVER = 2.5
_LAYERS = 3  # of ghosts: as many as the cover reaches

# Divergence, layers of ghosts, and whether another handler moves them.
_ARRANGEMENTS = (
    ("variational", 0, False),
    ("variational", _LAYERS, False),
    ("variational", _LAYERS, True),
    ("plain", _LAYERS, True),
)

# Linear systems of boundary values may be badly conditioned; their solution is promised all the
# same, to half of the digits.
_SOLVED = 1e-8

KIT = Kit()


@attrs.frozen(eq=False)
class _Sample:
    """A body that the handler accepts."""

    simulation: Simulation
    rng: np.random.Generator

    @property
    def terms(self) -> Sequence[Term]:
        """The terms of the handler."""
        return [term for term in self.simulation.terms if term.label == _LABEL]

    def random(self) -> Array:
        """Displacements (n, d) of a thousandth of a spacing [m]."""
        shape = self.simulation.particles.positions.shape
        return np.asarray(1e-3 * SPACING * self.rng.normal(size=shape))


@kept_for_last
def _simulations(handler: BoundaryHandler) -> list[Simulation]:
    """Scenes with every body that is not refused.

    Raises:
        SceneError: all of them are.
    """
    return accepted(
        "body",
        (
            (f"{d}D, {layers} layers of ghosts", partial(_simulation, handler, d, *rest))
            for d, rest in product(DIMENSIONS, _ARRANGEMENTS)
            for layers in [rest[1]]
        ),
        (BuildError, SceneError),
    )


def _samples(handler: BoundaryHandler) -> list[_Sample]:
    """The bodies, each with the same random numbers for every check."""
    return [_Sample(made, np.random.default_rng(k)) for k, made in enumerate(_simulations(handler))]


def _simulation(
    handler: BoundaryHandler, d: int, divergence: str, layers: int, extended: bool
) -> Simulation:
    lattice: dict[str, Any] = {"type": "lattice", "on_boundary": True}
    if layers:
        lattice |= {"ghosts": layers, "ghost_faces": ["left"]}
    builder = (
        scene(_COVER)
        .body("body", shape=box(_CELLS[d]), spacing=SPACING, discretisation=lattice)
        .formulation("total-lagrangian", divergence=divergence)
        .boundary(handler, label=_LABEL)
    )
    # Waves and not a rigid motion, small enough for any face to be held.
    with_waves(builder, d, 0.1, 4e-3)
    if extended:
        builder.boundary("ghost-extension", label="extension")
    return builder.build()


@KIT.check
def conditions(handler: BoundaryHandler) -> Verdict:
    """Some body is accepted, any other refused with a remedy; bound, the handler is one term or
    more under the label that it was given."""
    for sample in _samples(handler):
        bound = handler.bind(sample.simulation.model, _LABEL)
        if not bound or any(term.label != _LABEL for term in bound):
            raise Broken(f"{[(type(term).__name__, term.label) for term in bound]}")
    return Verdict(True, ", ".join(sorted({type(term).__name__ for term in bound})))


@KIT.errors(_SOLVED, none="it imposes no motion")
def held_only(handler: BoundaryHandler) -> Iterator[float]:
    """It imposes motion on the freedoms that it holds and changes no other, to the last bit; to
    impose it twice is to impose it once."""
    for sample, motion in _constraints(handler):
        for derivative in (0, 1, 2):
            free = sample.random()
            once = _imposed(sample, motion, 1e-3, derivative, free)
            if not np.array_equal(once[~motion.held], free[~motion.held]):
                raise Broken(f"derivative {derivative}: a free entry was changed")
            twice = _imposed(sample, motion, 1e-3, derivative, once)
            yield float(np.abs(twice - once).max() / max(np.abs(once).max(), 1e-300))


# A handler may take derivatives of a formula by differences over a step of the run, which err by
# its square: of a motion of 300 rad/s in steps of 0.1 ms, some 1e-4.
@KIT.errors(1e-3, none="it imposes no motion")
def rates(handler: BoundaryHandler) -> Iterator[float]:
    """Its velocity is the derivative of its displacement by time, its acceleration that of its
    velocity, whatever the free motion."""
    time, step = 2e-3, 1e-5
    for sample, motion in _constraints(handler):
        # The free motion u + v t + a t^2 / 2 and its derivatives.
        u, v, a = sample.random(), sample.random() / 1e-3, sample.random() / 1e-6
        for derivative in (1, 2):
            before, after = (
                _imposed(
                    sample,
                    motion,
                    t,
                    derivative - 1,
                    u + v * t + 0.5 * a * t**2 if derivative == 1 else v + a * t,
                )
                for t in (time - step, time + step)
            )
            rate = _imposed(
                sample, motion, time, derivative, v + a * time if derivative == 1 else a
            )
            error = np.abs(rate - (after - before) / (2.0 * step)).max()
            yield float(error / np.abs(rate).max())


@KIT.errors(_SOLVED, none="it moves no ghosts")
def virtual_power(handler: BoundaryHandler) -> Iterator[float]:
    """Forces on ghosts are returned to real particles so that they do the same work, by the
    transpose of the ghosts' motion; nothing is left on ghosts."""
    for sample, motion in _constraints(handler):
        if not isinstance(motion, GhostConstraint):
            continue
        ghosts = sample.simulation.particles.ghosts[:, None]
        u, f = sample.random(), np.where(ghosts, sample.random(), 0.0)
        du = np.where(motion.held, 0.0, sample.random())
        placed = _imposed(sample, motion, 0.0, 0, u + du) - _imposed(sample, motion, 0.0, 0, u)
        returned = f.copy()
        motion.return_forces(returned)
        scale = float(np.abs(f * placed).sum())
        yield abs(float(np.vdot(f, placed) - np.vdot(returned, du))) / scale
        left = np.abs(returned[ghosts & motion.held]).max(initial=0.0)
        yield float(left / np.abs(f).max())


@KIT.problems("as required", none="it imposes no stress")
def stresses(handler: BoundaryHandler) -> Iterator[str]:
    """Imposed stresses are finite, and those of ghosts and of particles on the surface; others are
    not changed, to the last bit."""
    for sample in _samples(handler):
        particles = sample.simulation.particles
        inside = ~particles.ghosts & ~np.any(particles.area_vectors != 0.0, axis=1)
        for term in sample.terms:
            if isinstance(term, StressTerm):
                d = particles.dimension
                stress = 1e3 * sample.rng.normal(size=(d, d, particles.count))
                before = stress.copy()
                term.impose_stress(1e-3, stress)
                same = np.array_equal(stress[:, :, inside], before[:, :, inside])
                yield "" if same else "the stress of a particle inside was changed"
                yield "" if np.all(np.isfinite(stress)) else "a stress is not finite"


@KIT.problems("as required", none="it adds no force")
def forces(handler: BoundaryHandler) -> Iterator[str]:
    """Its forces are one finite vector for each of its particles, which are named once and are no
    ghosts, and depend only on time, positions and velocities."""
    for sample in _samples(handler):
        for term in sample.terms:
            if isinstance(term, Load):
                yield force_problem(sample.simulation, term, sample.random())


# Differences leave the square of their step, 1e-8, and rounding over it.
@KIT.errors(1e-6, none="it has no stiffness")
def stiffness(handler: BoundaryHandler) -> Iterator[float]:
    """The stiffness that it tells Newton's method is minus the derivative of its force."""
    for sample in _samples(handler):
        for term in sample.terms:
            if isinstance(term, Load):
                u, du = 100.0 * sample.random(), sample.random()
                error = stiffness_error(sample.simulation, term, u, du)
                if error is not None:
                    yield error


@KIT.check
def report(handler: BoundaryHandler) -> Verdict:
    """Its report has finite numbers in columns "label quantity [unit]", the same at all times."""
    found: set[str] = set()
    for sample in _samples(handler):
        reports = [
            [term.report(observation) for term in sample.terms]
            for observation in observed(sample.simulation)
        ]
        columns = [[sorted(one) for one in several] for several in reports]
        if any(others != columns[0] for others in columns):
            raise Broken(f"columns {columns[0]}, then others")
        for of_a_term in (one for several in reports for one in several):
            check_report(_LABEL, of_a_term)
            found |= set(of_a_term)
    return Verdict(True, ", ".join(sorted(found)) or "nothing to report")


@KIT.check
def fields(handler: BoundaryHandler) -> Verdict:
    """Its fields are finite numbers, vectors or tensors of all particles, "quantity [unit]", the
    same ones at all times."""
    return worst([field_verdict(one.simulation, one.terms) for one in _samples(handler)])


@KIT.check
def derived(handler: BoundaryHandler) -> Verdict:
    """What a compilable kind derives from its arrays and its formula is not overridden by a method,
    which a compiled loop would not call."""
    return derived_verdict(term for sample in _samples(handler) for term in sample.terms)


# The trapezoidal rule over steps of a fortieth of the CFL step leaves its square, 6e-4, of the
# energy that waves of the shortest length exchange, and less of longer ones.
@KIT.errors(1e-3, none="the divergence that it needs is not the adjoint")
def energy_account(handler: BoundaryHandler) -> Iterator[float]:
    """The energy that the body gains is the work of the handler's account, if the forces derive
    from an energy."""
    for sample in _samples(handler):
        if sample.simulation.model.bodies[0].formulation.divergence.adjoint:
            yield residual(sample.simulation)


def _constraints(handler: BoundaryHandler) -> Iterator[tuple[_Sample, Constraint]]:
    for sample in _samples(handler):
        for term in sample.terms:
            if isinstance(term, Constraint):
                yield sample, term


def _imposed(
    sample: _Sample, motion: Constraint, time: float, derivative: int, free: Array
) -> Array:
    values = free.copy()
    motion.impose(time, derivative, values, sample.simulation.step_size)
    return values
