"""Digests of what a record holds: what is read must be what was written, to the last bit."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.layout import Field, PluginUsed

BYTES = 16
"""Length of a digest; two different contents have the same one by chance in 1e38."""


def step_digest(
    time: float, step: int, positions: Array, fields: Iterable[Array], history: Iterable[float]
) -> bytes:
    """Of one step; fields and history in the order in which the record declares them."""
    found = hashlib.blake2b(struct.pack("<dq", time, step), digest_size=BYTES)
    for values in (positions, *fields, np.array([*history], dtype=np.float64)):
        found.update(_bytes(values))
    return found.digest()


@attrs.frozen(eq=False)
class Reference:
    """What a record holds once, for all steps."""

    particles: Particles
    scene: str
    folder: str
    plugins: Sequence[PluginUsed]
    fields: Sequence[Field]
    columns: Mapping[str, str]
    versions: Mapping[str, str]
    notes: Sequence[str]

    def digest(self) -> bytes:
        """Of all of it."""
        found = hashlib.blake2b(digest_size=BYTES)
        for part in self._parts():
            # With its length, so that nothing can move from one part to the next.
            found.update(struct.pack("<q", len(part)))
            found.update(part)
        return found.digest()

    def _parts(self) -> Iterator[Any]:
        texts = [self.scene, self.folder, *self.notes]
        texts += [word for one in self.plugins for word in attrs.astuple(one)]
        texts += [f"{one.name} {one.components} {one.unit}" for one in self.fields]
        for table in (self.columns, self.versions):
            texts += [f"{name} {value}" for name, value in table.items()]
        yield from (text.encode(errors="replace").rstrip(b"\0") for text in texts)
        particles, n = self.particles, self.particles.count
        for values in (
            *(particles.positions, particles.volumes, particles.cells, particles.spacings),
            *(particles.area_vectors, particles.images, particles.ghosts),
        ):
            yield _bytes(values)
        for tag, mask in particles.tags.items():
            yield from (tag.encode(errors="replace"), _bytes(mask))
        for body, rows in particles.bodies.items():
            yield from (body.encode(errors="replace"), struct.pack("<qq", *rows.indices(n)[:2]))
        for name, face in particles.faces.items():
            yield name.encode(errors="replace")
            yield from map(_bytes, (face.particles, face.area_vectors, face.areas))


def _bytes(values: Any) -> memoryview:
    """Numbers as doubles, whatever they are stored as."""
    return np.ascontiguousarray(values, dtype="<f8").reshape(-1).view(np.uint8).data
