"""Contents of a record: reference data once, and outputs, one a step; each with its digest.

What is read must be what was written, to the last bit.
"""

from __future__ import annotations

import hashlib
import platform
import struct
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.layout import Field, PluginUsed
from solidsph.system.files import working_folder

BYTES = 16
"""Length of a digest; two different contents have the same digest by chance in 1e38."""


@attrs.frozen(eq=False)
class Output:
    """One step of a record. Its digest depends on the order of fields and columns."""

    time: float  # t [s]
    step: int  # number of completed steps of the integrator
    positions: Array  # (n, d) current positions [m]
    fields: Mapping[str, Array]  # (n, *components) by name, in the declared units
    history: Mapping[str, float]  # value of each column

    def digest(self) -> bytes:
        """Digest of everything in this output."""
        digest = hashlib.blake2b(struct.pack("<dq", self.time, self.step), digest_size=BYTES)
        columns = np.array([*self.history.values()], dtype=np.float64)
        for values in (self.positions, *self.fields.values(), columns):
            digest.update(_bytes(values))
        return digest.digest()


def installed() -> dict[str, str]:
    """Versions of the software that this process uses, by its name."""
    names = ("solidsph", "numpy", "scipy", "h5py")
    versions = {name: metadata.version(name) for name in names}
    return {**versions, "hdf5": h5py.version.hdf5_version, "python": platform.python_version()}


@attrs.frozen(eq=False, kw_only=True)
class Reference:
    """Data of a record that all its steps share."""

    particles: Particles
    scene: str  # what was asked for, as TOML text
    plugins: Sequence[PluginUsed]  # every part used
    fields: Sequence[Field]  # that each output holds besides the positions
    columns: Mapping[str, str]  # unit of each column of the history, by its name
    # Where relative paths in the scene begin.
    folder: str = attrs.field(factory=lambda: str(working_folder()))
    versions: Mapping[str, str] = attrs.field(factory=installed)  # of software, digests of files
    notes: Sequence[str] = ()  # what happened to the run, one line each

    def digest(self) -> bytes:
        """Digest of all reference data."""
        digest = hashlib.blake2b(digest_size=BYTES)
        for part in self._parts():
            # With its length, so that nothing can move from one part to the next.
            digest.update(struct.pack("<q", len(part)))
            digest.update(part)
        return digest.digest()

    def _parts(self) -> Iterator[Any]:
        texts = [self.scene, self.folder, *self.notes]
        texts += [word for plugin in self.plugins for word in attrs.astuple(plugin)]
        texts += [f"{field.name} {field.components} {field.unit}" for field in self.fields]
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
