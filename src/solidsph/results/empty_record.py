"""A record without a step: reference data, and datasets that steps are added to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.errors import RecordError
from solidsph.model.particles import Particles
from solidsph.results.contents import BYTES, Reference
from solidsph.results.layout import (
    FORMAT,
    MOST_TAGS,
    OUTCOME_BYTES,
    PARTICLE_ARRAYS,
    RUNNING,
    TAGS,
    VTKHDF_VERSION,
    Field,
    PluginUsed,
    body_name,
    padded,
    static_fields,
    tag_bits,
    tag_name,
)

_VERTEX = 1  # VTK's number for a cell of one point
_PAGE = 4096  # bytes; a chunk holds at least about as much
_LARGEST_CHUNK = 2**30  # bytes; HDF5 allows just under 4 GiB


def check_fields(fields: Sequence[Field], particles: Particles) -> None:
    """Raise RecordError unless a record of these particles can hold these fields."""
    d = particles.dimension
    taken = {field.name for field in static_fields(d)}
    for field in fields:
        if field.name in taken or not field.name.strip(".") or "/" in field.name:
            raise RecordError(
                f"a record cannot hold a field called {field.name!r}: the name is taken, or HDF5 "
                "does not allow it; choose another"
            )
        taken.add(field.name)
        if field.components not in ((), (d,), (d, d)):
            raise RecordError(
                f"field {field.name!r} has components {field.components}; in {d} dimensions they "
                f"are () for a scalar, ({d},) for a vector or ({d}, {d}) for a tensor"
            )


def reference_bytes(reference: Reference) -> int:
    """Size of the reference data in a file [bytes]."""
    particles = reference.particles
    cells, vector = 17, 24
    each = cells + 3 * vector + 4 * 8 + 5
    faces = sum(
        face.particles.nbytes + face.area_vectors.nbytes + face.areas.nbytes
        for face in particles.faces.values()
    )
    return each * particles.count + faces + len(reference.scene.encode())


def write_empty_record(file: Any, reference: Reference) -> None:
    """Write the reference data, and empty datasets for the steps, into a new HDF5 file."""
    _write_grid(file, reference.particles, reference.fields)
    _write_run(file, reference)


def _write_grid(file: Any, particles: Particles, fields: Sequence[Field]) -> None:
    """The group that VTK reads."""
    n = particles.count
    grid = file.create_group("VTKHDF")
    grid.attrs["Version"] = np.array(VTKHDF_VERSION)
    grid.attrs["Type"] = np.bytes_("UnstructuredGrid")
    for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
        grid[name] = np.array([n])
    grid["Connectivity"] = np.arange(n)
    grid["Offsets"] = np.arange(n + 1)
    grid["Types"] = np.full(n, _VERTEX, dtype=np.uint8)

    steps = grid.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(0)
    _row_per_step(steps, "Values", np.float64).attrs["units"] = _text("s")
    # The first row of a step: i n in what evolves, 0 in what all steps share. One dataset under
    # many names serves for each; the zeros, like the single part of a step, are never written.
    moving = _row_per_step(steps, "PointOffsets", np.int64)
    shared = _row_per_step(steps, "PartOffsets", np.int64)
    _row_per_step(steps, "NumberOfParts", np.int64, fill=1)
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = shared

    data, offsets = grid.create_group("PointData"), steps.create_group("PointDataOffsets")
    _rows_per_step(grid, Field("Points", (particles.dimension,), "m"), n)
    for field in fields:
        _rows_per_step(data, field, n)
        offsets[field.name] = moving
    arrays = {name: getattr(particles, array) for name, array in PARTICLE_ARRAYS.items()}
    arrays["body"] = np.full(n, -1, dtype=np.int32)
    for number, extent in enumerate(particles.bodies.values()):
        arrays["body"][extent] = number
    own_tags = _own_tags(particles)
    bits, further = tag_bits(own_tags[:MOST_TAGS]), own_tags[MOST_TAGS:]
    arrays[TAGS] = np.zeros(n, dtype=np.int64)
    for tag, bit in bits.items():
        arrays[TAGS][particles.tags[tag]] |= bit
    for field in static_fields(particles.dimension):
        rows = arrays[field.name]
        values = rows.astype(np.uint8) if rows.dtype == np.bool_ else rows
        _describe(data.create_dataset(field.name, data=padded(values, field.components)), field)
        offsets[field.name] = shared
    for tag in further:
        data[tag_name(tag)] = particles.tags[tag].astype(np.uint8)
        offsets[tag_name(tag)] = shared
    names = {tag_name(tag): bit for tag, bit in bits.items()}
    names |= {body_name(body): number for number, body in enumerate(particles.bodies)}
    _write_names(grid, names, shared)


def _own_tags(particles: Particles) -> Sequence[str]:
    """The tags that say more than the numbers of bodies, each of which is a tag, too."""

    def is_body(tag: str) -> bool:
        place = particles.bodies.get(tag)
        if place is None:
            return False
        mask = particles.tags[tag]
        return bool(mask[place].all()) and int(mask.sum()) == len(mask[place])

    return [tag for tag in particles.tags if not is_body(tag)]


def _write_names(grid: Any, names: Mapping[str, int], shared: Any) -> None:
    """What the integers of `tags` and `body` stand for.

    Numbers that have the names, since VTK crashes on texts in a file with times.
    """
    data, offsets = grid.create_group("FieldData"), grid["Steps"].create_group("FieldDataOffsets")
    for name, number in names.items():
        data[name] = np.array([number])
        offsets[name] = shared


def _write_run(file: Any, reference: Reference) -> None:
    """The group that VTK ignores."""
    particles, plugins, columns = reference.particles, reference.plugins, reference.columns
    run = file.create_group("solidsph")
    run.attrs["format"] = FORMAT
    run.attrs["dimension"] = particles.dimension
    run.attrs["folder"] = _text(reference.folder)
    run.attrs["digest"] = _text(reference.digest().hex())
    if reference.notes:
        run.attrs["notes"] = _texts(reference.notes)
    run["scene"] = _text(reference.scene)
    names = [column.name for column in attrs.fields(PluginUsed)]
    texts = {name: _texts([getattr(plugin, name) for plugin in plugins]) for name in names}
    table = np.empty(len(plugins), dtype=[(name, text.dtype) for name, text in texts.items()])
    for name, text in texts.items():
        table[name] = text
    run["plugins"] = table
    run["versions"] = _texts([f"{name} {version}" for name, version in reference.versions.items()])
    run["fields"] = _texts([field.name for field in reference.fields])
    run["tags"] = _texts(list(particles.tags))
    run["bits"] = _texts(_own_tags(particles)[:MOST_TAGS])
    run["bodies"] = _texts(list(particles.bodies))
    ranges = [rows.indices(particles.count)[:2] for rows in particles.bodies.values()]
    run["body_ranges"] = np.array(ranges, dtype=np.int64).reshape(-1, 2)
    for number, (name, face) in enumerate(particles.faces.items()):
        group = run.create_group(f"faces/{number}")
        group.attrs["name"] = _text(name)
        group["particles"] = np.asarray(face.particles, dtype=np.int64)
        group["area_vectors"] = face.area_vectors
        group["areas"] = face.areas
    room = h5py.string_dtype("utf-8", OUTCOME_BYTES)
    run.create_dataset("outcome", data=RUNNING.encode(), dtype=room)
    _row_per_step(run, "step", np.int64)
    run.create_dataset(
        "digests",
        shape=(0, BYTES),
        maxshape=(None, BYTES),
        chunks=(_PAGE // BYTES, BYTES),
        dtype=np.uint8,
    )
    if columns:
        history = _row_per_step(run, "history", [(name, np.float64) for name in columns])
        history.attrs["units"] = _texts(list(columns.values()))


def _texts(lines: Sequence[str]) -> Any:
    """Texts in one array, of fixed length: a damaged reference could cost the reader its memory."""
    encoded = [line.encode(errors="replace") for line in lines]
    longest = max((len(line) for line in encoded), default=0)
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", max(1, longest)))


def _text(line: str) -> Any:
    return _texts([line]).reshape(())


def _row_per_step(group: Any, name: str, kind: Any, fill: object = None) -> Any:
    """Create a dataset of one row a step."""
    rows = max(1, _PAGE // np.dtype(kind).itemsize)
    return group.create_dataset(
        name, shape=(0,), maxshape=(None,), chunks=(rows,), dtype=kind, fillvalue=fill
    )


def _rows_per_step(group: Any, field: Field, count: int) -> None:
    """Create a dataset of `count` rows a step."""
    width = (3 ** len(field.components),) if field.components else ()
    row_bytes = 8 * (width[0] if width else 1)
    # One step a chunk, so that it is read and written in one piece; small steps share a chunk.
    # Nothing is compressed, so part of a chunk costs no more than that part.
    rows = max(1, count) * max(1, _PAGE // (row_bytes * max(1, count)))
    rows = min(rows, _LARGEST_CHUNK // row_bytes)
    dataset = group.create_dataset(
        field.name,
        shape=(0, *width),
        maxshape=(None, *width),
        chunks=(rows, *width),
        dtype=np.float64,
        fillvalue=np.nan,  # never seen, and evident if it were
    )
    _describe(dataset, field)


def _describe(dataset: Any, field: Field) -> None:
    dataset.attrs["units"] = _text(field.unit)
    dataset.attrs["components"] = np.array(field.components, dtype=np.int64)
