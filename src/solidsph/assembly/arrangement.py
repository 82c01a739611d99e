"""The arrangement of a scene, without the gradients and operators of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from solidsph.assembly.body import plain_body
from solidsph.assembly.initial_state import initial_state
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.marks import Arrows, Mark
from solidsph.model.particles import State
from solidsph.results.arrangement import Arrangement
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.placed_parts import PlacedParts
from solidsph.scene.scene import Scene


def arrangement_of(scene: Scene) -> Arrangement:
    """What a picture shows of a scene.

    Raises:
        BuildError: with all problems of its parts and places.
    """
    placed = PlacedParts(scene)
    problems, parts = placed.problems, placed.parts
    placed.stop_if_any()
    particles, conditions = problems.settled(placed.placed)
    attempts = [
        problems.attempt(plain_body, name, parts, particles.bodies[name]) for name in parts.sets
    ]
    placed.stop_if_any()
    bodies = [problems.settled(body) for body in attempts]
    model = DiscreteModel(
        particles=particles,
        masses=np.concatenate([body.masses for body in bodies]),
        bodies=bodies,
        end=scene.duration,
        conditions=conditions,
    )
    marks = {
        label: problems.attempt(part.marks, model, label)
        for label, part in (*parts.handlers.items(), *parts.effects.items())
    }
    initial = problems.attempt(initial_state, scene, particles)
    if scene.probes:
        placed.check_places()
    problems.stop_if_any()
    return _arranged(
        scene,
        model,
        {label: problems.settled(own) for label, own in marks.items()},
        problems.settled(initial),
    )


def arrangement_of_built(built: BuiltScene) -> Arrangement:
    """What a picture shows of a built scene."""
    parts: Mapping[str, BoundaryHandler | Effect] = {**built.handlers, **built.effects}
    marks = {label: part.marks(built.model, label) for label, part in parts.items()}
    return _arranged(built.scene, built.model, marks, built.initial)


def _arranged(
    scene: Scene, model: DiscreteModel, marks: Mapping[str, Sequence[Mark]], initial: State
) -> Arrangement:
    found = dict(marks)
    moving = np.flatnonzero(initial.velocities.any(axis=1))
    if len(moving):
        X, v = model.particles.positions[moving], initial.velocities[moving]
        found["initial"] = [Arrows("velocity", "m/s", X, v)]
    return Arrangement(scene.title, model, found, scene.probes)
