"""Assembly: names -> parts -> a checked Simulation.

This is the edge where names end. Every part is made and every pair of parts is checked here, all
problems are reported together, and what comes out holds objects only.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any

import attrs
import numpy as np
import pluggy

from solidsph import compatibility, handed_back, registry
from solidsph.blame import described
from solidsph.body import Body
from solidsph.dynamics import Dynamics
from solidsph.engines.history import HistoryFields, remembering
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.condition import (
    Condition,
    ForceCondition,
    MotionCondition,
    Observation,
    StressCondition,
)
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.making import Making, Parts
from solidsph.motion import VectorField
from solidsph.particles import Particles, State
from solidsph.results.shown import clashes
from solidsph.scene import MOST_STEPS, Scene
from solidsph.setting import Setting
from solidsph.simulation import Simulation
from solidsph.smoothing import smoothing_kernel
from solidsph.step_size import largest_step
from solidsph.surface import Conditions
from solidsph.visibility import hidden_pairs
from solidsph.where import Where, select


def wrong_besides(scene: Scene, *, complete: bool) -> Sequence[str]:
    """Problems of a scene of which something could not be read and was left out.

    Args:
        scene: what could be read.
        complete: whether all of its bodies are there, so that tags can be looked for.
    """
    return Assembly(scene, pluggy.PluginManager("solidsph")).problems(places=complete)


class Assembly:
    """One build of one scene."""

    def __init__(self, scene: Scene, manager: pluggy.PluginManager) -> None:
        self._scene = scene
        self._manager = manager
        self._making = Making(scene)
        self._problems = self._making.problems

    def simulation(self) -> Simulation:
        """Build it.

        Raises:
            BuildError: with every problem found, each with its remedy.
        """
        scene, problems = self._scene, self._problems
        parts = self._making.parts()
        placed = self._placed(parts)
        self._stop_if_any(parts, None if placed is None else placed[0])

        particles, tag_conditions = problems.settled(placed)
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
        self._stop_if_any(parts, particles)

        made = [problems.settled(body) for body in bodies]
        scheme = problems.settled(parts.integrator)
        problems.attempt(self._check_constants, scheme, effects, made)
        self._stop_if_any(parts, particles)
        step = problems.attempt(self._step_size, scheme, effects, made)
        self._stop_if_any(parts, particles)
        steps = max(1, ceil(scene.duration / problems.settled(step) * (1.0 - 1e-12)))
        setting = Setting(
            particles=particles,
            masses=np.concatenate([body.masses for body in made]),
            bodies=made,
            step_size=scene.duration / steps,
            end=scene.duration,
            conditions=tag_conditions,
        )
        conditions = self._bound(parts.handlers, effects, setting)
        problems.stop_if_any()
        motions = _in_order([c for c in conditions if isinstance(c, MotionCondition)], particles)
        stresses = [c for c in conditions if isinstance(c, StressCondition)]
        problems.add(compatibility.motions(motions, particles))
        forces = [c for c in conditions if isinstance(c, ForceCondition)]
        problems.add(compatibility.loads(forces, particles, formulation))
        problems.add(compatibility.stresses(stresses, formulation))
        initial = problems.attempt(self._initial_state, particles)
        chosen_engine = problems.settled(parts.engine)
        internal = problems.attempt(chosen_engine.prepare, setting.bodies, stresses, steps)
        for effect in effects.values() if internal is not None else ():
            internal = problems.attempt(effect.within, internal, setting, stresses) or internal
        problems.add(compatibility.history(made, scene, self._making.labels))
        problems.stop_if_any()
        remembered = [body for body in made if isinstance(body.material, HistoryMaterial)]
        if remembered:
            conditions.append(HistoryFields(remembered, particles.count))
        problems.add(clashes(_at_rest(problems.settled(initial), setting, conditions), conditions))
        problems.stop_if_any()

        made_ready = Simulation(
            scene=scene,
            setting=setting,
            dynamics=Dynamics(
                particles=particles,
                masses=setting.masses,
                internal=remembering(problems.settled(internal), made, stresses),
                motions=motions,
                loads=forces,
            ),
            conditions=tuple(conditions),
            effects=effects,
            integrator=scheme,
            engine=chosen_engine,
            initial=problems.settled(initial),
            step_size=setting.step_size,
            steps=steps,
            parts=tuple(self._making.used),
            manager=self._manager,
        )
        if scene.sleep is not None:
            from solidsph.asleep.loop import check_sleep  # only where something sleeps

            problems.attempt(check_sleep, made_ready)
            problems.stop_if_any()
        if self._making.foreign:
            from solidsph.first_use import ask  # only where there is somebody to be asked

            problems.attempt(ask, made_ready, self._making.foreign)
            problems.stop_if_any()
        return made_ready

    def problems(self, *, places: bool) -> Sequence[str]:
        """What is wrong with the scene's words, their values and, if asked for, its places."""
        parts = self._making.parts()
        placed = self._placed(parts)
        if places and placed is not None:
            self._look_for(placed[0])
        self._read_formulas(parts)
        return self._problems.found

    def _check_constants(
        self, integrator: Integrator, effects: Mapping[str, Effect], bodies: Sequence[Body]
    ) -> None:
        self._problems.add(handed_back.limits(integrator))
        for body in bodies:
            self._problems.add(handed_back.constants(body.material))
        for label, effect in effects.items():
            self._problems.add(handed_back.rates(label, effect, bodies))

    def _placed(self, parts: Parts) -> tuple[Particles, Conditions] | None:
        """The particles of all bodies with their tags, and what these say, if there are any."""
        problems, shapes, sets = self._problems, parts.shapes, parts.sets
        fitting = [
            *compatibility.dimensions(shapes, parts.cover),
            *compatibility.names(sets),
        ]
        problems.add(fitting)
        one_dimension = len({shape.dimension for shape in shapes.values()}) == 1
        if not one_dimension or len(sets) < len(self._scene.bodies):
            return None
        return self._tagged(Particles.joined(sets))

    def _stop_if_any(self, parts: Parts, placed: Particles | None) -> None:
        """Stop if there are problems; those found later, of places and formulas, are told too."""
        if self._problems.found:
            if placed is not None:
                self._look_for(placed)
            self._read_formulas(parts)
        self._problems.stop_if_any()

    def _read_formulas(self, parts: Parts) -> None:
        """Note formulas of parts and initial values that cannot be read."""
        fields: list[tuple[object, str]] = []
        for label, part in (*parts.handlers.items(), *parts.effects.items()):
            fields += [
                (getattr(part, field.name), f"{label}: {field.name}")
                for field in attrs.fields(type(part))
                if "Component" in str(field.type)  # annotations are text here
            ]
        for entry in self._scene.initial:
            fields += [
                (entry.displacement, "initial: displacement"),
                (entry.velocity, "initial: velocity"),
            ]
        for value, what in fields:
            if isinstance(value, Mapping):
                self._problems.attempt(VectorField.of, value, what)
            elif isinstance(value, (str, int, float)):
                self._problems.attempt(VectorField.of, {"x": value}, what)

    def _look_for(self, particles: Particles) -> None:
        """Note places of boundaries, effects and initial values that match no particle."""
        scene = self._scene
        tags = {tag for body in scene.bodies.values() for tag in body.tags}
        wrong = {tag.replace("-", "_") for tag in tags - set(particles.tags)}  # told already
        places: list[object] = [initial.where for initial in scene.initial]
        for entry in (*scene.boundaries, *scene.effects):
            part = entry.part
            where = part.get("where") if isinstance(part, Mapping) else getattr(part, "where", None)
            places.append(where)
        for where in dict.fromkeys(one for one in places if isinstance(one, str)):
            if not wrong.intersection(re.findall(r"\w+", where.replace("-", "_"))):
                self._problems.attempt(select, particles, where)

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
        gradient = formulation.gradient.of_body(body)
        if gradient is formulation.gradient:
            return body
        return attrs.evolve(body, formulation=_with_gradient(formulation, gradient))

    def _tagged(self, particles: Particles) -> tuple[Particles, Conditions]:
        """Particles with the tags that the scene adds to its bodies, and what these say."""
        tags = dict(particles.tags)
        conditions: dict[str, list[tuple[slice, Where]]] = {}
        taken = compatibility.Names(particles.tags)
        for name, body in self._scene.bodies.items():
            extent = particles.bodies[name]
            for tag, where in body.tags.items():
                wrong = "" if tag in conditions else taken.problem(tag)
                if wrong:
                    self._problems.add([f"body {name!r}: tag {tag!r} {wrong}"])
                    continue
                taken.add(tag)
                chosen = self._problems.attempt(select, particles, where)
                if chosen is not None:
                    mask = tags.get(tag, np.zeros(particles.count, dtype=np.bool_)).copy()
                    mask[chosen[(chosen >= extent.start) & (chosen < extent.stop)]] = True
                    tags[tag] = mask
                    conditions.setdefault(tag, []).append((extent, where))
        return attrs.evolve(particles, tags=tags), conditions

    def _bound(
        self,
        handlers: Mapping[str, Any],
        effects: Mapping[str, Effect],
        setting: Setting,
    ) -> list[Condition]:
        conditions: list[Condition] = []
        parts = [("boundaries", *one) for one in handlers.items()]
        parts += [("effects", *one) for one in effects.items()]
        for kind, label, part in parts:
            conditions += self._problems.attempt(self._bind, kind, part, setting, label) or []
        return conditions

    def _bind(self, kind: str, part: Any, setting: Setting, label: str) -> Sequence[Condition]:
        bound = part.bind(setting, label)
        wrong = list(handed_back.conditions(kind, label, part, bound))
        if wrong:
            raise BuildError(wrong)
        found: Sequence[Condition] = [bound] if kind == "effects" else bound
        particles = setting.particles
        for one in found:
            wrong += handed_back.shapes(one, particles.count, particles.dimension)
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
        self, integrator: Integrator, effects: Mapping[str, Effect], bodies: Sequence[Body]
    ) -> float:
        """Time step [s] from the confined wave speed and whatever the effects add."""
        scene = self._scene
        largest = largest_step(integrator, effects.values(), bodies)
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


def _at_rest(initial: State, setting: Setting, conditions: Sequence[Condition]) -> Observation:
    """The particles where they are in the reference, before anything has happened."""
    particles, (n, d) = setting.particles, initial.positions.shape
    # Views of one number: they take no memory.
    none, nothing = np.broadcast_to(0.0, n), np.broadcast_to(0.0, (n, d))
    remembers = any(isinstance(body.material, HistoryMaterial) for body in setting.bodies)
    labels = [c.label for c in conditions if isinstance(c, (ForceCondition, MotionCondition))]
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
        masses=setting.masses,
        deformation_gradients=np.broadcast_to(np.eye(d), (n, d, d)),
        stresses=np.broadcast_to(0.0, (n, d, d)),
        energy_densities=none,
        dissipated_densities=none if remembers else None,
    )


def _in_order(
    motions: Sequence[MotionCondition], particles: Particles
) -> tuple[MotionCondition, ...]:
    """Motions of particles first, then those of ghosts, which follow particles."""
    return tuple(sorted(motions, key=lambda m: bool(m.held[particles.ghosts].any())))


def _with_gradient(formulation: Formulation, gradient: Gradient) -> Formulation:
    """The same formulation with another gradient, which is a field of every attrs class."""
    changed: Formulation = attrs.evolve(formulation, gradient=gradient)  # type: ignore[misc]
    return changed
