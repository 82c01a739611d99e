"""What a record's reader takes from the open file: texts, rows and particles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from solidsph.maths.arrays import Mask
from solidsph.model.particles import Face, Particles
from solidsph.results.layout import (
    FORMAT,
    PARTICLE_ARRAYS,
    TAGS,
    static_fields,
    tag_bits,
    tag_name,
    unpadded,
)


def lines(group: Any, name: str) -> tuple[str, ...]:
    """Texts of a dataset."""
    return tuple(line.decode() for line in group[name][()])


def word(item: Any, name: str) -> str:
    """Text of an attribute."""
    return bytes(item.attrs[name]).decode()


def first_rows(dataset: Any, rows: int) -> Any:
    """The first rows of a dataset; OSError if it has fewer."""
    check_rows(dataset, rows)
    return dataset[:rows]


def check_rows(dataset: Any, rows: int) -> None:
    """Raise OSError if a dataset has fewer rows."""
    if dataset.shape[0] < rows:
        # Damage, or the run went on since the last read: then a new attempt helps.
        raise OSError(f"{dataset.name} has {dataset.shape[0]} rows instead of {rows}")


def read_particles(run: Any, data: Any, dimension: int) -> Particles:
    """Reference data of all particles, from the group of the run and that of point data."""
    arrays: dict[str, Any] = {
        PARTICLE_ARRAYS[field.name]: unpadded(data[field.name][()], field.components)
        for field in static_fields(dimension)
        if field.name in PARTICLE_ARRAYS
    }
    arrays["ghosts"] = arrays["ghosts"].astype(np.bool_)
    bodies = {
        name: slice(int(start), int(stop))
        for name, (start, stop) in zip(lines(run, "bodies"), run["body_ranges"][()], strict=True)
    }
    return Particles(
        **arrays,
        tags=dict(_tags(run, data, bodies)),
        bodies=bodies,
        faces=dict(_face(run[f"faces/{number}"]) for number in range(len(run.get("faces", ())))),
    )


def _tags(run: Any, data: Any, bodies: Mapping[str, slice]) -> Iterator[tuple[str, Mask]]:
    """Every tag and its mask."""
    names = lines(run, "tags")
    if int(run.attrs["format"]) < FORMAT:
        for name in names:
            yield name, data[tag_name(name)][()].astype(np.bool_)
        return
    rows, bits = data[TAGS][()], tag_bits(lines(run, "bits"))
    if (rows >> len(bits)).any():
        raise ValueError(f"{data[TAGS].name} has bits of no tag")
    for name in names:
        if name in bits:
            mask = (rows & bits[name]).astype(np.bool_)
        elif tag_name(name) in data:
            mask = data[tag_name(name)][()].astype(np.bool_)
        else:
            mask = np.zeros(len(rows), dtype=np.bool_)
            mask[bodies[name]] = True
        yield name, mask


def _face(group: Any) -> tuple[str, Face]:
    indices = group["particles"][()].astype(np.intp)
    return word(group, "name"), Face(indices, group["area_vectors"][()], group["areas"][()])
