"""PlacedParts: the parts of a scene and the particles of its bodies, as far as they can be made."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from solidsph.model.fields import VectorField
from solidsph.model.particles import Particles
from solidsph.model.regions import Where, select
from solidsph.model.surface import Conditions
from solidsph.scene import compatibility
from solidsph.scene.part_maker import PartMaker
from solidsph.scene.scene_data import SceneData


def wrong_besides(scene: SceneData, *, complete: bool) -> Sequence[str]:
    """Problems of a scene of which something could not be read and was left out.

    Args:
        scene: what could be read.
        complete: whether all of its bodies are there, so that tags can be looked for.
    """
    words = PlacedParts(scene)
    if complete:
        words.look_for_places()
    words.read_formulas()
    return words.problems.found


class PlacedParts:
    """Names of a scene are understood here; what is wrong with them is noted in `problems`."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene
        making = PartMaker(scene)
        self.problems = making.problems
        self.labels = making.labels  # of the accounts of boundaries and effects
        self.used = making.used  # plugins in the order of their use, each once
        self.foreign = making.foreign  # kind and part, of those that are not our own
        self.parts = making.parts()
        self.placed = self._placed()

    def stop_if_any(self) -> None:
        """Stop if there are problems; those of places and formulas are told too.

        Raises:
            BuildError: with every problem found.
        """
        if self.problems.found:
            self.look_for_places()
            self.read_formulas()
        self.problems.stop_if_any()

    def _placed(self) -> tuple[Particles, Conditions] | None:
        """The particles of all bodies with their tags, and what these say, if there are any."""
        problems, shapes, sets = self.problems, self.parts.shapes, self.parts.sets
        fitting = [
            *compatibility.dimensions(shapes, self.parts.cover),
            *compatibility.names(sets),
        ]
        problems.add(fitting)
        one_dimension = len({shape.dimension for shape in shapes.values()}) == 1
        if not one_dimension or len(sets) < len(self._scene.bodies):
            return None
        return self._tagged(Particles.joined(sets))

    def read_formulas(self) -> None:
        """Note formulas of parts and initial values that cannot be read."""
        fields: list[tuple[object, str]] = []
        for label, part in (*self.parts.handlers.items(), *self.parts.effects.items()):
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
                self.problems.attempt(VectorField.of, value, what)
            elif isinstance(value, (str, int, float)):
                self.problems.attempt(VectorField.of, {"x": value}, what)

    def look_for_places(self) -> None:
        """Note places of boundaries, effects and initial values that match no particle."""
        if self.placed is None:
            return
        (particles, _), scene = self.placed, self._scene
        tags = {tag for body in scene.bodies.values() for tag in body.tags}
        wrong = {tag.replace("-", "_") for tag in tags - set(particles.tags)}  # told already
        places: list[object] = [initial.where for initial in scene.initial]
        for entry in (*scene.boundaries, *scene.effects):
            part = entry.part
            where = part.get("where") if isinstance(part, Mapping) else getattr(part, "where", None)
            places.append(where)
        for where in dict.fromkeys(one for one in places if isinstance(one, str)):
            if not wrong.intersection(re.findall(r"\w+", where.replace("-", "_"))):
                self.problems.attempt(select, particles, where)

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
                    self.problems.add([f"body {name!r}: tag {tag!r} {wrong}"])
                    continue
                taken.add(tag)
                chosen = self.problems.attempt(select, particles, where)
                if chosen is not None:
                    mask = tags.get(tag, np.zeros(particles.count, dtype=np.bool_)).copy()
                    mask[chosen[(chosen >= extent.start) & (chosen < extent.stop)]] = True
                    tags[tag] = mask
                    conditions.setdefault(tag, []).append((extent, where))
        return attrs.evolve(particles, tags=tags), conditions
