"""Assembler: names -> parts -> a checked Simulation.

This is the edge where names end. Every part is made and every pair of parts is checked here, all
problems are reported together, and what comes out holds objects only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any, TypeVar

import attrs
import numpy as np
import pluggy

from solidsph.assembly.visibility import hidden_pairs
from solidsph.engines.history import HistoryFields, modified
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.interfaces.terms import (
    Constraint,
    Load,
    Observation,
    StressTerm,
    Term,
)
from solidsph.model.fields import VectorField
from solidsph.model.particles import Particles, State
from solidsph.model.regions import select
from solidsph.registry import registry
from solidsph.registry.origin import described
from solidsph.results.output_fields import name_clashes
from solidsph.run.built_scene import BuiltScene
from solidsph.run.dynamics import Dynamics
from solidsph.run.stable_step import stable_step
from solidsph.scene import compatibility, returned_values
from solidsph.scene.placed_parts import PlacedParts
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import MOST_STEPS

S = TypeVar("S", bound=BuiltScene)


class Assembler:
    """One build of one scene."""

    def __init__(self, scene: Scene, manager: pluggy.PluginManager) -> None:
        self._scene = scene
        self._manager = manager
        self._words = PlacedParts(scene)
        self._problems = self._words.problems

    def built(self, kind: type[S]) -> S:
        """Build it, as an object of class `kind`.

        Raises:
            BuildError: with every problem found, each with its remedy.
        """
        scene, problems = self._scene, self._problems
        if scene.silence:
            from solidsph import advice  # only where its names are asked for

            problems.add(advice.unknown_names(scene.silence))
        words = self._words
        words.stop_if_any()
        parts = words.parts

        particles, tag_conditions = problems.settled(words.placed)
        effects = parts.effects
        kernel = problems.settled(parts.kernel)
        cover = problems.settled(parts.cover)
        formulation = problems.settled(parts.formulation)
        problems.add(compatibility.apart(parts.shapes, parts.sets))
        bodies = [
            problems.attempt(
                self._body,
                name,
                parts.shapes[name],
                particles,
                own,
                parts.materials[name],
                kernel,
                cover,
                formulation,
            )
            for name, own in parts.sets.items()
        ]
        words.stop_if_any()

        made = [problems.settled(body) for body in bodies]
        integrator = problems.settled(parts.integrator)
        problems.add(returned_values.limits(integrator))
        for body in made:
            problems.add(returned_values.constants(body.material))
        words.stop_if_any()
        model = DiscreteModel(
            particles=particles,
            masses=np.concatenate([body.masses for body in made]),
            bodies=made,
            end=scene.duration,
            conditions=tag_conditions,
        )
        terms = self._bound(parts.handlers, effects, model)
        words.stop_if_any()
        constraints = _in_order([c for c in terms if isinstance(c, Constraint)], particles)
        stresses = [c for c in terms if isinstance(c, StressTerm)]
        loads = [c for c in terms if isinstance(c, Load)]
        step = problems.attempt(self._step_size, integrator, loads, made)
        problems.add(compatibility.motions(constraints, particles))
        problems.add(compatibility.loads(loads, particles, formulation))
        problems.add(compatibility.stresses(stresses, formulation))
        problems.add(compatibility.history(made, scene, words.labels))
        initial = problems.attempt(self._initial_state, particles)
        words.stop_if_any()
        steps = max(1, ceil(scene.duration / problems.settled(step) * (1.0 - 1e-12)))
        engine = problems.settled(parts.engine)
        # An equilibrium is found with assembled matrices: there is nothing to compile for.
        evaluations = steps if scene.statics is None else 1
        internal = problems.attempt(engine.prepare, made, stresses, evaluations)
        problems.stop_if_any()
        internal = problems.attempt(modified, internal, made, terms, stresses)
        problems.stop_if_any()
        remembered = [body for body in made if isinstance(body.material, HistoryMaterial)]
        if remembered:
            terms.append(HistoryFields(remembered, particles.count))
        problems.add(name_clashes(_at_rest(problems.settled(initial), model, terms), terms))
        problems.stop_if_any()

        made_ready = kind(
            scene=scene,
            model=model,
            dynamics=Dynamics(
                particles=particles,
                masses=model.masses,
                internal=problems.settled(internal),
                constraints=constraints,
                loads=loads,
                step_size=scene.duration / steps,
            ),
            terms=tuple(terms),
            effects=effects,
            integrator=integrator,
            engine=engine,
            initial=problems.settled(initial),
            steps=steps,
            parts=tuple(words.used),
            manager=self._manager,
        )
        if scene.sleep is not None:
            from solidsph.run.sleeping.loop import check_sleep  # only where something sleeps

            problems.attempt(check_sleep, made_ready)
            problems.stop_if_any()
        if words.foreign:
            from solidsph.assembly.first_use import ask  # only where there is somebody to be asked

            problems.attempt(ask, made_ready, words.foreign)
            problems.stop_if_any()
        return made_ready

    def _body(
        self,
        name: str,
        shape: Shape,
        particles: Particles,
        own: Particles,
        material: Material,
        kernel: Kernel,
        cover: float,
        formulation: Formulation,
    ) -> Body:
        radius = cover * float(own.spacings.max())
        body = Body(
            name=name,
            shape=shape,
            extent=particles.bodies[name],
            particles=own,
            smoothing=smoothing_kernel(kernel, own.dimension, radius),
            material=material,
            formulation=formulation,
            hidden=hidden_pairs(
                shape,
                own,
                radius,
                moving=formulation.configuration is Configuration.CURRENT,
            ),
        )
        gradient = formulation.gradient.of_body(
            name,
            own,
            body.smoothing,
            body.pairs,
            moving=formulation.configuration is Configuration.CURRENT,
        )
        if gradient is formulation.gradient:
            return body
        return attrs.evolve(body, formulation=_with_gradient(formulation, gradient))

    def _bound(
        self,
        handlers: Mapping[str, Any],
        effects: Mapping[str, Effect],
        model: DiscreteModel,
    ) -> list[Term]:
        terms: list[Term] = []
        parts = [("boundaries", *one) for one in handlers.items()]
        parts += [("effects", *one) for one in effects.items()]
        for kind, label, part in parts:
            terms += self._problems.attempt(self._bind, kind, part, model, label) or []
        return terms

    def _bind(self, kind: str, part: Any, model: DiscreteModel, label: str) -> Sequence[Term]:
        bound = part.bind(model, label)
        wrong = list(returned_values.conditions(kind, label, part, bound))
        if wrong:
            raise BuildError(wrong)
        found: Sequence[Term] = [bound] if kind == "effects" else bound
        particles = model.particles
        for one in found:
            wrong += returned_values.shapes(one, particles.count, particles.dimension)
        if not wrong:
            for load in found:
                if isinstance(load, Load):
                    wrong += returned_values.rates(load)
        if wrong:
            raise BuildError([f"{described(registry.entry_of(kind, part))}, {w}" for w in wrong])
        return found

    def _initial_state(self, particles: Particles) -> State:
        # By shape and not `zeros_like`: pages of zeros that are never written take no memory.
        displacements = np.zeros(particles.positions.shape)
        velocities = np.zeros(particles.positions.shape)
        for entry in self._scene.initial:
            chosen = select(particles, entry.where)
            for table, values, what in (
                (entry.displacement, displacements, "initial: displacement"),
                (entry.velocity, velocities, "initial: velocity"),
            ):
                if table is None:
                    continue
                field = VectorField.of(table, what)
                field.check_dimension(particles.dimension, what)
                field.check_without("t", "it is the state at t = 0: use numbers, X, Y and Z")
                X = particles.positions[chosen]
                for axis in field.components:
                    values[chosen, axis] = field.values(axis, X, 0.0)
        return State(
            time=0.0,
            step=0,
            positions=particles.positions + displacements,
            velocities=velocities,
            accelerations=np.zeros(velocities.shape),
        )

    def _step_size(
        self, integrator: Integrator, loads: Sequence[Load], bodies: Sequence[Body]
    ) -> float:
        """Time step [s] from the confined wave speed and whatever the loads add."""
        scene = self._scene
        largest = stable_step(integrator, loads, bodies)
        if scene.time_step is not None and scene.time_step > largest:
            raise SceneError(
                f"time_step = {scene.time_step:.6g} s exceeds the CFL step, {largest:.6g} s by "
                "confined wave speed and spacing; take a smaller one, or state time_step_factor "
                "instead"
            )
        step = scene.time_step or scene.time_step_factor * largest
        if not (step > 0.0 and scene.duration / step <= MOST_STEPS):
            raise SceneError(
                f"a duration of {scene.duration:.6g} s in steps of {step:.6g} s takes "
                f"{scene.duration / step if step > 0.0 else float('inf'):.3g} steps, at most "
                f"{MOST_STEPS:.0e} are allowed; shorten the duration, or check the units of "
                "modulus, density and spacing"
            )
        return step


def _at_rest(initial: State, model: DiscreteModel, terms: Sequence[Term]) -> Observation:
    """The particles where they are in the reference, before anything has happened."""
    particles, (n, d) = model.particles, initial.positions.shape
    # Views of one number: they take no memory.
    none, nothing = np.broadcast_to(0.0, n), np.broadcast_to(0.0, (n, d))
    remembers = any(isinstance(body.material, HistoryMaterial) for body in model.bodies)
    labels = [c.label for c in terms if isinstance(c, (Load, Constraint))]
    return Observation(
        state=attrs.evolve(
            initial,
            positions=particles.positions,
            velocities=nothing,
            accelerations=nothing,
            applied=dict.fromkeys(labels, nothing),
            work=dict.fromkeys(labels, 0.0),
        ),
        particles=particles,
        masses=model.masses,
        deformation_gradients=np.broadcast_to(np.eye(d), (n, d, d)),
        stresses=np.broadcast_to(0.0, (n, d, d)),
        energy_densities=none,
        dissipated_densities=none if remembers else None,
    )


def _in_order(motions: Sequence[Constraint], particles: Particles) -> tuple[Constraint, ...]:
    """Motions of particles first, then those of ghosts, which follow particles."""
    return tuple(sorted(motions, key=lambda m: bool(m.held[particles.ghosts].any())))


def _with_gradient(formulation: Formulation, gradient: Gradient) -> Formulation:
    """The same formulation with another gradient, which is a field of every attrs class."""
    changed: Formulation = attrs.evolve(formulation, gradient=gradient)  # type: ignore[misc]
    return changed
