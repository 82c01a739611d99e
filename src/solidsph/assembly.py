"""Assembly: names -> parts -> a checked Simulation.

This is the edge where names end. Every part is made and every pair of parts is checked here, all
problems are reported together, and what comes out holds objects only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any

import attrs
import numpy as np
import pluggy

from solidsph import compatibility, handed_back, registry
from solidsph.blame import described, is_foreign
from solidsph.body import Body
from solidsph.dynamics import Dynamics
from solidsph.engines.engine import Engine
from solidsph.engines.history import HistoryFields, remembering
from solidsph.engines.select import engine_named
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.condition import (
    Condition,
    ForceCondition,
    MotionCondition,
    StressCondition,
)
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.motion import VectorField
from solidsph.particles import Particles, State
from solidsph.parts import construct
from solidsph.problems import Problems
from solidsph.scene import DEFAULT_INTEGRATOR, BodyScene, ImposedScene, PartLike, Scene
from solidsph.setting import Setting
from solidsph.simulation import Simulation
from solidsph.smoothing import smoothing_kernel
from solidsph.step_size import largest_step
from solidsph.where import EVERYWHERE, select

# No run of more steps ends; a scene that asks for them has its units wrong.
_MOST_STEPS = 1e10


class Assembly:
    """One build of one scene."""

    def __init__(self, scene: Scene, manager: pluggy.PluginManager) -> None:
        self._scene = scene
        self._manager = manager
        self._labels: set[str] = set()  # of the accounts of boundaries and effects
        self._used: dict[registry.Entry, None] = {}  # plugins in the order of their use, each once
        self._foreign: list[tuple[str, Any]] = []  # kind and part, of those that are not our own
        self._problems = Problems(self._used.keys())

    def simulation(self) -> Simulation:
        """Build it.

        Raises:
            BuildError: with every problem found, each with its remedy.
        """
        scene, problems = self._scene, self._problems
        problems.add(compatibility.numbers(scene))
        problems.add(compatibility.statics(scene))
        problems.add(compatibility.sleep(scene))
        if scene.silence:
            from solidsph import advice  # only where its names are asked for

            problems.add(advice.unknown(scene.silence))
        kernel: Kernel | None = self._make("kernels", scene.kernel)
        formulation: Formulation | None = self._make("formulations", scene.formulation)
        integrator = self._integrator()
        engine: Engine | None = problems.attempt(engine_named, _engine_name(scene))
        handlers = self._labelled("boundaries", scene.boundaries)
        effects: dict[str, Effect] = self._labelled("effects", scene.effects)
        shapes, sets, materials = self._body_parts()
        problems.add(compatibility.effects(effects))
        problems.stop_if_any()

        problems.add(compatibility.dimensions(shapes, scene.cover))
        problems.stop_if_any()
        problems.add(compatibility.names(sets))
        problems.stop_if_any()
        particles = self._tagged(Particles.joined(sets))
        problems.add(compatibility.apart(shapes, particles))
        bodies = [
            problems.attempt(self._body, name, particles, own, material, kernel, formulation)
            for (name, own), material in zip(sets.items(), materials.values(), strict=True)
        ]
        problems.stop_if_any()

        made = [problems.settled(body) for body in bodies]
        scheme = problems.settled(integrator)
        problems.attempt(self._check_constants, scheme, effects, made)
        problems.stop_if_any()
        step = problems.attempt(self._step_size, scheme, effects, made)
        problems.stop_if_any()
        steps = max(1, ceil(scene.duration / problems.settled(step) * (1.0 - 1e-12)))
        setting = Setting(
            particles=particles,
            masses=np.concatenate([body.masses for body in made]),
            bodies=made,
            step_size=scene.duration / steps,
        )
        conditions = self._bound(handlers, effects, setting)
        problems.stop_if_any()
        motions = _in_order([c for c in conditions if isinstance(c, MotionCondition)], particles)
        stresses = [c for c in conditions if isinstance(c, StressCondition)]
        problems.add(compatibility.motions(motions, particles))
        forces = [c for c in conditions if isinstance(c, ForceCondition)]
        problems.add(compatibility.loads(forces, particles, problems.settled(formulation)))
        problems.add(compatibility.stresses(stresses, problems.settled(formulation)))
        initial = problems.attempt(self._initial_state, particles)
        chosen_engine = problems.settled(engine)
        internal = problems.attempt(chosen_engine.prepare, setting.bodies, stresses, steps)
        for effect in effects.values() if internal is not None else ():
            internal = problems.attempt(effect.within, internal, setting, stresses) or internal
        problems.add(compatibility.history(made, scene, self._labels))
        problems.stop_if_any()
        remembered = [body for body in made if isinstance(body.material, HistoryMaterial)]
        if remembered:
            conditions.append(HistoryFields(remembered, particles.count))

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
            parts=tuple(self._used),
            manager=self._manager,
        )
        if scene.sleep is not None:
            from solidsph.asleep.loop import check_sleep  # only where something sleeps

            problems.attempt(check_sleep, made_ready)
            problems.stop_if_any()
        if self._foreign:
            from solidsph.first_use import ask  # only where there is somebody to be asked

            problems.attempt(ask, made_ready, self._foreign)
            problems.stop_if_any()
        return made_ready

    def _make(self, kind: str, wanted: PartLike) -> Any:
        part = self._problems.attempt(construct, kind, wanted)
        if part is not None:
            self._note(kind, part)
        return part

    def _integrator(self) -> Integrator | None:
        """The scene's, or the default, which is not noted where nothing will move by it."""
        made: Integrator | None = (
            self._make("integrators", self._scene.integrator or DEFAULT_INTEGRATOR)
            if self._scene.statics is None
            else self._problems.attempt(construct, "integrators", DEFAULT_INTEGRATOR)
        )
        return made

    def _check_constants(
        self, integrator: Integrator, effects: Mapping[str, Effect], bodies: Sequence[Body]
    ) -> None:
        self._problems.add(handed_back.limits(integrator))
        for body in bodies:
            self._problems.add(handed_back.constants(body.material))
        for label, effect in effects.items():
            self._problems.add(handed_back.rates(label, effect, bodies))

    def _note(self, kind: str, part: Any) -> None:
        """Remember which plugins a part, and the parts inside it, came from."""
        entry = registry.entry_of(kind, part)
        self._used[entry] = None
        if is_foreign(entry):
            self._foreign.append((kind, part))
        if not attrs.has(type(part)):
            return
        for field in attrs.fields(type(part)):
            nested = field.metadata.get("part")
            if nested is not None:
                value = getattr(part, field.name)
                for one in value if isinstance(value, (list, tuple)) else [value]:
                    self._note(nested, one)

    def _labelled(self, kind: str, entries: Sequence[ImposedScene]) -> dict[str, Any]:
        """Parts by the label of their account: the one given, or one made of name and place."""
        made: dict[str, Any] = {}
        for entry in entries:
            part = self._make(kind, entry.part)
            if part is None:
                continue
            label = entry.label or _label(kind, part)
            if not label.isprintable():
                self._problems.add([f"label {label!r} has signs that cannot be shown; use others"])
            if label in self._labels and entry.label:
                self._problems.add(
                    [f"two accounts are labelled {label!r}; give each a label of its own"]
                )
            while label in self._labels:
                label = f"{label}'"
            self._labels.add(label)
            made[label] = part
        return made

    def _body_parts(
        self,
    ) -> tuple[dict[str, Shape], dict[str, Particles], dict[str, Material]]:
        """Shape, particles and material of every body, by its name."""
        shapes: dict[str, Shape] = {}
        sets: dict[str, Particles] = {}
        materials: dict[str, Material] = {}
        for name, body in self._scene.bodies.items():
            shape: Shape | None = self._make("shapes", body.shape)
            discretisation: Discretisation | None = self._make(
                "discretisations", body.discretisation
            )
            material = self._material(name, body)
            if shape is None or discretisation is None or material is None:
                continue
            particles = self._problems.attempt(discretisation.particles, shape, body.spacing)
            if particles is not None:
                wrong = list(handed_back.particles(discretisation, particles, shape.dimension))
                self._problems.add(wrong)
                if wrong:
                    continue
                shapes[name], sets[name], materials[name] = shape, particles, material
        return shapes, sets, materials

    def _material(self, name: str, body: BodyScene) -> Material | None:
        wanted = body.material if body.material is not None else self._scene.material
        if wanted is None:
            self._problems.add(
                [f"body {name!r} has no material; give it one, or one to the whole scene"]
            )
            return None
        material: Material | None = self._make("materials", wanted)
        return material

    def _body(
        self,
        name: str,
        particles: Particles,
        own: Particles,
        material: Material,
        kernel: Kernel,
        formulation: Formulation,
    ) -> Body:
        radius = self._scene.cover * float(own.spacings.max())
        body = Body(
            name=name,
            extent=particles.bodies[name],
            particles=own,
            smoothing=smoothing_kernel(kernel, own.dimension, radius),
            material=material,
            formulation=formulation,
        )
        gradient = formulation.gradient.of_body(body)
        if gradient is formulation.gradient:
            return body
        return attrs.evolve(body, formulation=_with_gradient(formulation, gradient))

    def _tagged(self, particles: Particles) -> Particles:
        """Particles with the tags that the scene adds to its bodies."""
        tags = dict(particles.tags)
        for name, body in self._scene.bodies.items():
            extent = particles.bodies[name]
            for tag, where in body.tags.items():
                wrong = compatibility.name_problem(tag, particles.tags)
                if wrong:
                    self._problems.add([f"body {name!r}: tag {tag!r} {wrong}"])
                    continue
                chosen = self._problems.attempt(select, particles, where)
                if chosen is not None:
                    mask = tags.get(tag, np.zeros(particles.count, dtype=np.bool_)).copy()
                    mask[chosen[(chosen >= extent.start) & (chosen < extent.stop)]] = True
                    tags[tag] = mask
        return attrs.evolve(particles, tags=tags)

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
        if not (step > 0.0 and scene.duration / step <= _MOST_STEPS):
            raise SceneError(
                f"a duration of {scene.duration:.6g} s in steps of {step:.6g} s takes "
                f"{scene.duration / step if step > 0.0 else float('inf'):.3g} steps, at most "
                f"{_MOST_STEPS:.0e} are allowed; shorten the duration, or check the units of "
                "modulus, density and spacing"
            )
        return step


def _engine_name(scene: Scene) -> str:
    """Equilibria are found with assembled matrices: there is nothing to compile."""
    return "matrix" if scene.statics is not None and scene.engine == "auto" else scene.engine


def _in_order(
    motions: Sequence[MotionCondition], particles: Particles
) -> tuple[MotionCondition, ...]:
    """Motions of particles first, then those of ghosts, which follow particles."""
    return tuple(sorted(motions, key=lambda m: bool(m.held[particles.ghosts].any())))


def _with_gradient(formulation: Formulation, gradient: Gradient) -> Formulation:
    """The same formulation with another gradient, which is a field of every attrs class."""
    changed: Formulation = attrs.evolve(formulation, gradient=gradient)  # type: ignore[misc]
    return changed


def _label(kind: str, part: object) -> str:
    name = registry.entry_of(kind, part).name or type(part).__name__
    where = getattr(part, "where", None)
    if isinstance(where, str) and where not in (EVERYWHERE, "ghosts"):
        return f"{name} {where}"
    return name
