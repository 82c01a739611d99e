"""Layout of a record: what it holds and where, by names that its writer and its reader share.

A record is one HDF5 file. `/VTKHDF` is an UnstructuredGrid of one vertex a particle, with time,
that ParaView opens as it is; `/solidsph`, which VTK ignores, holds everything else. VTK knows three
dimensions only, so a vector is padded with zeros to 3 components and a tensor to 9.

| where | rows | what |
| --- | --- | --- |
| `/VTKHDF/Points`, `/VTKHDF/PointData/<field>` | n every step, step after step | what evolves |
| `/VTKHDF/PointData/<other>` | n | reference data, shared by all steps |
| `/VTKHDF/Steps` | 1 every step | times, and the first row of each step in the above |
| `/VTKHDF/Steps`, attribute `NSteps` | | how many steps are complete: written last |
| `/VTKHDF/FieldData/tag <name>` | 1 | the bit of a tag in the integers of `PointData/tags` |
| `/VTKHDF/FieldData/body <name>` | 1 | the number of a body in `PointData/body` |
| `/solidsph/step`, `/solidsph/history` | 1 every step | step numbers; named columns |
| `/solidsph/error_bars` | 1 every quantity | numbers and their estimated errors, if any |
| `/solidsph/digests` | 1 every step | digest of everything in the step |
| `/solidsph/tags`, `/solidsph/bits` | 1 every tag | names; those that have a bit, from the lowest |
| the rest of `/solidsph` | | scene, plugins, versions, bodies, faces, outcome; a digest |
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.registry import Entry

FORMAT = 3  # that is written
READABLE = (2, FORMAT)  # a reader refuses any other; in 2, each tag is a field of its own
MOST_TAGS = 62  # that are bits of a signed integer; others have arrays of their own
VTKHDF_VERSION = (2, 0)  # the first with time; higher ones add nothing that is used here
RECORD_SUFFIXES = (".h5", ".vtkhdf")  # `.vtkhdf` is what VTK and PyVista know it by
RUNNING = "running"  # the outcome until the writer is closed
OUTCOME_BYTES = 1024  # of fixed length, since nothing can be allocated for it at the end

# What h5py raises for a file that is damaged, not ours, or on a device that fails.
HDF5_ERRORS = (
    *(OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError),
    *(ArithmeticError, MemoryError),
)


@attrs.frozen
class Field:
    """One array over the particles that every step of a record holds."""

    name: str
    components: tuple[int, ...]  # () scalar, (d,) vector, (d, d) tensor
    unit: str  # SI; "-" if dimensionless


@attrs.frozen
class PluginUsed:
    """Origin of one part of a run."""

    group: str  # "solidsph.kernels"
    name: str  # "cubic-spline"
    distribution: str
    version: str
    target: str  # "package.module:Class"

    @classmethod
    def of(cls, entry: Entry) -> PluginUsed:
        """Convert an entry of the registry."""
        return cls(entry.kind, entry.name, entry.distribution, entry.version, entry.target)


PARTICLE_ARRAYS = {
    "reference_position": "positions",
    "volume": "volumes",
    "cell": "cells",
    "spacing": "spacings",
    "area_vector": "area_vectors",
    "ghost": "ghosts",
    "image": "images",
}
"""Arrays of reference data: name in a record -> attribute of `Particles`."""


TAGS = "tags"
"""The field of integers that hold the tags of each particle."""


def static_fields(dimension: int) -> tuple[Field, ...]:
    """Names, shapes and units of the particles' reference data in a record."""
    d = dimension
    return (
        Field("reference_position", (d,), "m"),
        Field("volume", (), f"m^{d}" if d > 1 else "m"),
        Field("cell", (), f"m^{d}" if d > 1 else "m"),
        Field("spacing", (), "m"),
        Field("area_vector", (d,), {1: "-", 2: "m"}.get(d, f"m^{d - 1}")),
        Field("ghost", (), "-"),  # 1 for a ghost
        Field("image", (d,), "m"),
        Field("body", (), "-"),  # number of the body, -1 outside all
        Field(TAGS, (), "-"),  # the sum of the bits of its tags, but for that of the body
    )


def tag_name(tag: str) -> str:
    """Name of the number that is the bit of a tag; of those beyond `MOST_TAGS`, and in format 2, of
    the array that marks it."""
    return "tag " + field_name(tag)


def body_name(body: str) -> str:
    """Name of the number of a body."""
    return "body " + field_name(body)


def tag_bits(tags: Iterable[str]) -> dict[str, int]:
    """Bit of each tag: 1, 2, 4 and so on."""
    return {tag: 1 << place for place, tag in enumerate(tags)}


def field_name(quantity: str) -> str:
    """Name of the array of a quantity; `/` would be a group to HDF5."""
    return quantity.replace("%", "%25").replace("/", "%2F")


def padded(values: Array, components: tuple[int, ...]) -> Array:
    """Pad rows for VTK: (n,) stays, (n, d) becomes (n, 3), (n, d, d) becomes (n, 9)."""
    if not components or components == (3,):
        return values
    cubic = np.zeros((len(values), *(3 for _ in components)))
    cubic[(slice(None), *(slice(size) for size in components))] = values
    return cubic.reshape(len(values), 3 ** len(components))


def unpadded(rows: Array, components: tuple[int, ...]) -> Array:
    """The inverse of `padded`, for any number of rows."""
    cubic = rows.reshape(len(rows), *(3 for _ in components))
    return np.ascontiguousarray(cubic[(slice(None), *(slice(size) for size in components))])


def reason(error: BaseException) -> str:
    """Message of an error of HDF5 or of the system, in one line and without internals."""
    text = " ".join(str(error).split())
    system = re.search("error message = '([^']*)'", text)
    return system[1] if system else re.sub(r"^\[Errno \d+\] ", "", text)
