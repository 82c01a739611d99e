"""The part of a body's surface at a `where`.

A particle at an edge owns some of each face that meets there. So a condition on a surface is
evaluated for *pieces* and not for particles; a piece is what one particle owns of one face. The
name of a face holds on the pieces of that face only, everything else where it holds for the owner.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TypeAlias

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Face, Particles
from solidsph.model.regions import EVERYWHERE, Where, holds

Conditions: TypeAlias = Mapping[str, Sequence[tuple[slice, Where]]]
"""Conditions of the tags that a scene adds, by tag: that of each body that adds it."""


@attrs.frozen(eq=False, slots=False)
class Pieces:
    """The surface of all bodies in pieces, one for each particle and face."""

    particles: Particles
    conditions: Conditions
    owners: Indices  # (m,) the particle that owns each
    faces: NDArray[np.intp]  # (m,) number of its face
    names: Sequence[str]  # of the faces
    area_vectors: Array  # (m, d) outward [m^(d-1)]
    areas: Array  # (m,) [m^(d-1)]

    @classmethod
    def of(cls, particles: Particles, conditions: Conditions) -> Pieces:
        """The pieces of the surface of `particles`; the scene's tags are evaluated for pieces."""
        faces = list(particles.faces.values())
        counts = [face.particles.size for face in faces]
        d = particles.dimension
        return cls(
            particles=particles,
            conditions=conditions,
            owners=np.concatenate([np.zeros(0, np.intp), *(face.particles for face in faces)]),
            faces=np.repeat(np.arange(len(faces)), counts),
            names=tuple(particles.faces),
            area_vectors=np.concatenate([np.zeros((0, d)), *(face.area_vectors for face in faces)]),
            areas=np.concatenate([np.zeros(0), *(face.areas for face in faces)]),
        )

    def at(self, where: Where) -> Mask:
        """The pieces at `where`, (m,).

        Raises:
            SceneError: `where` cannot be understood.
        """
        return holds(self.particles, where, self._tagged, self.owners)

    def unnamed(self, where: Where) -> Mask:
        """The pieces at `where` that match it without the names of faces too, (m,)."""
        return self.at(where) & holds(self.particles, where, self._tagged_faceless, self.owners)

    def owned(self, chosen: Mask) -> Face:
        """The chosen pieces (m,) as a face, with its particles in rising order."""
        particles, which = np.unique(self.owners[chosen], return_inverse=True)
        area_vectors = np.zeros((particles.size, self.area_vectors.shape[1]))
        np.add.at(area_vectors, which, self.area_vectors[chosen])
        areas = np.zeros(particles.size)
        np.add.at(areas, which, self.areas[chosen])
        return Face(particles, area_vectors, areas)

    @cached_property
    def bodies(self) -> NDArray[np.intp]:
        """Number of the body of each, (m,)."""
        ends = [extent.stop for extent in self.particles.bodies.values()]
        return np.searchsorted(ends, self.owners, side="right")

    def _tagged(self, tag: str) -> Mask:
        if tag in self.names:
            return np.asarray(self.faces == self.names.index(tag))
        return self._by_owner(tag, self._tagged)

    def _tagged_faceless(self, tag: str) -> Mask:
        if tag in self.names:
            return np.zeros(self.owners.shape, dtype=np.bool_)
        return self._by_owner(tag, self._tagged_faceless)

    def _by_owner(self, tag: str, tagged: Callable[[str], Mask]) -> Mask:
        particles = self.particles
        if tag == EVERYWHERE:
            return ~particles.ghosts[self.owners]
        if tag not in self.conditions:
            return np.asarray(particles.tags[tag][self.owners])
        mask = np.zeros(self.owners.shape, dtype=np.bool_)
        for extent, where in self.conditions[tag]:
            inside = (self.owners >= extent.start) & (self.owners < extent.stop)
            mask |= inside & holds(particles, where, tagged, self.owners)
        return mask
