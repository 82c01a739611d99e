"""PlacedParts: the parts of a scene, and the particles of its bodies with their tags."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from solidsph.model.fields import VectorField
from solidsph.model.particles import Particles
from solidsph.model.regions import Where, select
from solidsph.model.surface import Conditions
from solidsph.registry.parameters import is_formula
from solidsph.scene.checks.geometry import check_dimensions
from solidsph.scene.checks.names import ParticleSetNames, check_names
from solidsph.scene.part_maker import PartMaker
from solidsph.scene.scene_data import SceneData


def further_problems(scene: SceneData, *, complete: bool) -> Sequence[str]:
    """Problems of a scene that could be read in part only.

    Args:
        scene: the part that could be read.
        complete: whether it has all bodies, so that places can be checked.
    """
    parts = PlacedParts(scene)
    if complete:
        parts.check_places()
    parts.check_formulas()
    return parts.problems.found


class PlacedParts:
    """Parts and particles of a scene; mistakes are collected in `problems`."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene
        maker = PartMaker(scene)
        self.problems = maker.problems
        self.parts = maker.parts()
        self.labels = maker.labels  # of the accounts of boundaries and effects
        self.used = maker.used  # plugins in the order of their first use
        self.foreign = maker.foreign  # kind and part of third parties
        self.placed = self._placed()

    def stop_if_any(self) -> None:
        """Raise BuildError if there are problems; places and formulas are then checked too."""
        if self.problems.found:
            self.check_places()
            self.check_formulas()
        self.problems.stop_if_any()

    def _placed(self) -> tuple[Particles, Conditions] | None:
        """Particles of all bodies, and the conditions of their tags; None if bodies are missing."""
        shapes, sets = self.parts.shapes, self.parts.sets
        self.problems.add(check_dimensions(shapes, self.parts.cover))
        self.problems.add(check_names(sets))
        one_dimension = len({shape.dimension for shape in shapes.values()}) == 1
        if not one_dimension or len(sets) < len(self._scene.bodies):
            return None
        return self._tagged(Particles.joined(sets))

    def check_formulas(self) -> None:
        """Note formulas of parts and initial values that cannot be parsed."""
        formulas: list[tuple[object, str]] = []
        for label, part in (*self.parts.handlers.items(), *self.parts.effects.items()):
            formulas += [
                (getattr(part, field.name), f"{label}: {field.name}")
                for field in attrs.fields(type(part))
                if is_formula(field)
            ]
        for entry in self._scene.initial:
            formulas += [
                (entry.displacement, "initial: displacement"),
                (entry.velocity, "initial: velocity"),
            ]
        for value, what in formulas:
            if isinstance(value, Mapping):
                self.problems.attempt(VectorField.of, value, what)
            elif isinstance(value, (str, int, float)):
                self.problems.attempt(VectorField.of, {"x": value}, what)

    def check_places(self) -> None:
        """Note places of boundaries, effects and initial values that match no particle."""
        if self.placed is None:
            return
        (particles, _), scene = self.placed, self._scene
        tags = {tag for body in scene.bodies.values() for tag in body.tags}
        wrong = {tag.replace("-", "_") for tag in tags - set(particles.tags)}  # noted already
        places: list[object] = [initial.where for initial in scene.initial]
        for entry in (*scene.boundaries, *scene.effects):
            part = entry.part
            where = part.get("where") if isinstance(part, Mapping) else getattr(part, "where", None)
            places.append(where)
        for where in dict.fromkeys(place for place in places if isinstance(place, str)):
            if not wrong.intersection(re.findall(r"\w+", where.replace("-", "_"))):
                self.problems.attempt(select, particles, where)
        for probe in self.parts.probes:
            self.problems.attempt(self._check_probe, probe)

    def _check_probe(self, probe: Any) -> None:
        from solidsph.probes.probe import named  # loaded only for [[probe]]

        assert self.placed is not None
        with named(probe):
            probe.check_place(self.parts.shapes, self.placed[0])

    def _tagged(self, particles: Particles) -> tuple[Particles, Conditions]:
        """Particles with the tags that the scene adds, and the conditions of these tags."""
        tags = dict(particles.tags)
        conditions: dict[str, list[tuple[slice, Where]]] = {}
        names = ParticleSetNames(particles.tags)
        for name, body in self._scene.bodies.items():
            extent = particles.bodies[name]
            for tag, where in body.tags.items():
                wrong = "" if tag in conditions else names.problem(tag)
                if wrong:
                    self.problems.add([f"body {name!r}: tag {tag!r} {wrong}"])
                    continue
                names.add(tag)
                chosen = self.problems.attempt(select, particles, where)
                if chosen is not None:
                    mask = tags.get(tag, np.zeros(particles.count, dtype=np.bool_)).copy()
                    mask[chosen[(chosen >= extent.start) & (chosen < extent.stop)]] = True
                    tags[tag] = mask
                    conditions.setdefault(tag, []).append((extent, where))
        return attrs.evolve(particles, tags=tags), conditions
