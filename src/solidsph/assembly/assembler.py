"""Assembler: from the names of a scene to a checked simulation.

Names end here: what comes out holds objects only. All parts are made and checked against each
other, and all problems are reported together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import pluggy

from solidsph.assembly.binding import bind
from solidsph.assembly.body import make_body
from solidsph.assembly.initial_state import initial_state, reference_observation
from solidsph.assembly.shared_holds import shared_once
from solidsph.assembly.step_size import expected_steps, with_its_step
from solidsph.engines.law_forces import HistoryFields, modified
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Constraint, Load, StressTerm, Term
from solidsph.model.particles import Particles, State
from solidsph.results.output_fields import name_clashes
from solidsph.run.built_scene import BuiltScene
from solidsph.run.dynamics import Dynamics
from solidsph.scene.checks.geometry import check_overlaps
from solidsph.scene.checks.returned import check_integrator, check_material
from solidsph.scene.checks.terms import (
    check_constraints,
    check_history,
    check_loads,
    check_stresses,
)
from solidsph.scene.placed_parts import PlacedParts
from solidsph.scene.scene import Scene
from solidsph.scene.static_solver import expected_evaluations
from solidsph.system.build_log import BUILD

S = TypeVar("S", bound=BuiltScene)


class Assembler:
    """Assembly of one scene."""

    def __init__(self, scene: Scene, manager: pluggy.PluginManager) -> None:
        self._scene = scene
        self._manager = manager
        self._placed = PlacedParts(scene)
        self._parts = self._placed.parts
        self._problems = self._placed.problems

    def assemble(self, kind: type[S]) -> S:
        """Assemble the scene as an object of class `kind`.

        Raises:
            BuildError: with all problems, each with its remedy.
        """
        if self._scene.silence:
            from solidsph import advice  # loaded only for its names

            self._problems.add(advice.unknown_names(self._scene.silence))
        self._placed.stop_if_any()
        model = self._model()
        terms = self._terms(model)
        probes = self._probes(model, terms)
        initial, steps = self._start_and_steps(model, terms)
        dynamics = self._dynamics(model, terms, steps)
        histories = [b for b in model.bodies if isinstance(b.material, HistoryMaterial)]
        if histories:
            terms.append(HistoryFields(histories, model.particles.count))
        at_rest = reference_observation(initial, model, terms)
        self._problems.add(name_clashes(at_rest, [*terms, *probes]))
        self._problems.stop_if_any()
        built = kind(
            scene=self._scene,
            model=model,
            dynamics=dynamics,
            terms=tuple(terms),
            handlers=self._parts.handlers,
            effects=self._parts.effects,
            integrator=self._problems.settled(self._parts.integrator),
            engine=self._problems.settled(self._parts.engine),
            initial=initial,
            steps=steps,
            parts=tuple(self._placed.used),
            manager=self._manager,
            probes=tuple(probes),
        )
        self._check_built(built)
        BUILD.info("time step")
        stepped: S | None = self._problems.attempt(with_its_step, built)
        return self._problems.settled(stepped)

    def _model(self) -> DiscreteModel:
        """All bodies in discrete form."""
        problems, parts = self._problems, self._parts
        particles, conditions = problems.settled(self._placed.placed)
        problems.add(check_overlaps(parts.shapes, parts.sets))
        attempts = [
            problems.attempt(make_body, name, parts, particles.bodies[name]) for name in parts.sets
        ]
        self._placed.stop_if_any()
        bodies = [problems.settled(body) for body in attempts]
        problems.add(check_integrator(problems.settled(parts.integrator)))
        for body in bodies:
            problems.add(check_material(body.material))
        self._placed.stop_if_any()
        return DiscreteModel(
            particles=particles,
            masses=np.concatenate([body.masses for body in bodies]),
            bodies=bodies,
            end=self._scene.duration,
            conditions=conditions,
        )

    def _terms(self, model: DiscreteModel) -> list[Term]:
        """Bound boundaries and effects."""
        BUILD.info("boundaries and effects")
        terms: list[Term] = []
        for kind, several in (
            ("boundaries", self._parts.handlers),
            ("effects", self._parts.effects),
        ):
            for label, part in several.items():
                terms += self._problems.attempt(bind, kind, part, model, label) or []
        return shared_once(terms, self._scene.duration)

    def _probes(self, model: DiscreteModel, terms: Sequence[Term]) -> list[Term]:
        """Bound probes."""
        if not self._parts.probes:
            return []
        from solidsph.assembly.probes import bind_probe  # loaded only for [[probe]]

        accounts = {t.label for t in terms if isinstance(t, (Load, Constraint))}
        missing = {*self._placed.labels} - {term.label for term in terms}  # not bound, and noted
        attempts = [
            self._problems.attempt(bind_probe, probe, model, accounts | missing)
            for probe in self._parts.probes
        ]
        return [bound for bound in attempts if bound is not None]

    def _start_and_steps(self, model: DiscreteModel, terms: Sequence[Term]) -> tuple[State, int]:
        """Initial state and expected number of steps, after checks that the terms fit."""
        scene, problems = self._scene, self._problems
        integrator = problems.settled(self._parts.integrator)
        formulation = problems.settled(self._parts.formulation)
        loads = _loads(terms)
        # A term that could not be bound would only reduce the stable step.
        steps = problems.attempt(expected_steps, scene, integrator, loads, model.bodies)
        self._placed.stop_if_any()
        constraints = _constraints(terms, model.particles)
        problems.add(check_constraints(constraints, model.particles))
        problems.add(check_loads(loads, model.particles, formulation))
        problems.add(check_stresses(_stresses(terms), formulation))
        problems.add(check_history(model.bodies, self._placed.labels))
        initial = problems.attempt(initial_state, scene, model.particles)
        self._placed.stop_if_any()
        return problems.settled(initial), problems.settled(steps)

    def _dynamics(self, model: DiscreteModel, terms: Sequence[Term], steps: int) -> Dynamics:
        """Equation of motion, with the internal forces that the engine prepares."""
        problems, stresses = self._problems, _stresses(terms)
        engine = problems.settled(self._parts.engine)
        evaluations, statics = steps, self._scene.statics
        if statics is not None:
            n, d = model.particles.positions.shape
            evaluations = expected_evaluations(statics.solver, d, n * d)
        BUILD.info("weights of neighbours")
        internal = problems.attempt(engine.prepare, model.bodies, stresses, evaluations)
        internal = problems.attempt(
            modified, problems.settled(internal), model.bodies, terms, stresses
        )
        return Dynamics(
            particles=model.particles,
            masses=model.masses,
            internal=problems.settled(internal),
            constraints=_constraints(terms, model.particles),
            loads=_loads(terms),
            step_size=self._scene.duration / steps,
        )

    def _check_built(self, built: BuiltScene) -> None:
        """Check that the scene can sleep if it is to, and promises of third-party parts."""
        if self._scene.sleep is not None:
            from solidsph.run.sleeping.loop import check_sleep  # loaded only for [sleep]

            self._problems.attempt(check_sleep, built)
            self._problems.stop_if_any()
        if self._placed.foreign:
            from solidsph.assembly.first_use import check_first_use  # only for third parties

            self._problems.attempt(check_first_use, built, self._placed.foreign)
            self._problems.stop_if_any()


def _constraints(terms: Sequence[Term], particles: Particles) -> Sequence[Constraint]:
    """Constraints on particles first, then those on ghosts, which follow particles."""
    constraints = [term for term in terms if isinstance(term, Constraint)]
    return tuple(sorted(constraints, key=lambda c: bool(c.held[particles.ghosts].any())))


def _loads(terms: Sequence[Term]) -> Sequence[Load]:
    return [term for term in terms if isinstance(term, Load)]


def _stresses(terms: Sequence[Term]) -> Sequence[StressTerm]:
    return [term for term in terms if isinstance(term, StressTerm)]
