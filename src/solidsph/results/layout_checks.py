"""Whether a file has the layout of a record: what must be where, of which type and shape.

`layout` says what each thing means; here is what its reader relies on, as one table. What is only
VTK's is not read, so not looked at. A file that does not fit gives a `ValueError` that says where.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.model.particles import Particles
from solidsph.results.digest import BYTES
from solidsph.results.layout import HDF5_ERRORS, static_fields, tag_name

# Sizes by name: of particles, components of a place (VTK's are always 3), and at least one row a
# step, or a particle and a step. ANY is any number.
N, STEPS, ROWS, ANY = "particles", "steps", "rows", "any"
_AT_LEAST = (STEPS, ROWS)

_FLOAT, _WHOLE, _TEXT, _TABLE = "f", "iu", "S", "V"
_WORDS = {_FLOAT: "real numbers", _WHOLE: "whole numbers", _TEXT: "texts", _TABLE: "a table"}
_LARGEST_DIMENSION = 3

# Compression makes data smaller by some factor, of zeros by a thousand at most.
_MOST_COMPRESSED = 1100


@attrs.frozen
class Entry:
    """A dataset, or one of its or a group's attributes."""

    path: str
    kind: str  # of NumPy's data types
    shape: tuple[int | str, ...]
    attribute: str = ""  # its name; none is the dataset itself
    is_optional: bool = False


_FIRST = (
    Entry("solidsph", _WHOLE, (), "dimension"),
    Entry("solidsph", _TEXT, (), "digest"),
    Entry("solidsph", _TEXT, (), "folder"),
    Entry("solidsph", _TEXT, (ANY,), "notes", is_optional=True),
    Entry("VTKHDF/Steps", _WHOLE, (), "NSteps"),
    *(Entry(f"solidsph/{name}", _TEXT, ()) for name in ("scene", "outcome")),
    *(
        Entry(f"solidsph/{name}", _TEXT, (ANY,))
        for name in ("versions", "fields", "tags", "bodies")
    ),
    Entry("solidsph/plugins", _TABLE, (ANY,)),
    Entry("solidsph/body_ranges", _WHOLE, (ANY, 2)),
    Entry("VTKHDF/PointData/volume", _FLOAT, (ANY,)),
)
"""What tells what else there is."""


def check_first(tree: Tree) -> None:
    """That what tells the rest is there.

    Raises:
        ValueError: something does not fit.
    """
    for entry in _FIRST:
        _check(tree, entry, {})
    dimension = tree.item("solidsph").attrs["dimension"]
    if not 1 <= dimension <= _LARGEST_DIMENSION:
        raise ValueError(f"solidsph@dimension is {dimension}, not 1, 2 or 3")
    steps = tree.item("VTKHDF/Steps").attrs["NSteps"]
    if steps < 0:
        raise ValueError(f"VTKHDF/Steps@NSteps is {steps}, below 0")
    plugins = tree.item("solidsph/plugins").dtype
    if len(plugins.names or ()) != 5 or any(plugins[i].kind != _TEXT for i in range(5)):
        raise ValueError("solidsph/plugins is not a table of five texts")


def check_rest(tree: Tree, steps: int, fields: Sequence[str], tags: Sequence[str]) -> None:
    """That all else is there, for so many steps.

    Raises:
        ValueError: something does not fit.
    """
    d = int(tree.item("solidsph").attrs["dimension"])
    n = len(tree.item("VTKHDF/PointData/volume"))
    sizes = {N: n, STEPS: steps, ROWS: n * steps}
    for entry in _rest(tree, d, fields, tags):
        _check(tree, entry, sizes)
    history = tree.item("solidsph/history", is_optional=True)
    if history is not None:
        columns = history.dtype
        if any(columns[i].kind != _FLOAT for i in range(len(columns.names or ()))):
            raise ValueError("solidsph/history has a column that holds no real numbers")
        units = Entry("solidsph/history", _TEXT, (len(columns.names or ()),), "units")
        _check(tree, units, sizes)


def _rest(tree: Tree, d: int, fields: Sequence[str], tags: Sequence[str]) -> Iterator[Entry]:
    data = "VTKHDF/PointData"
    yield Entry("VTKHDF/Steps/Values", _FLOAT, (STEPS,))
    yield Entry("solidsph/step", _WHOLE, (STEPS,))
    yield Entry("solidsph/digests", _WHOLE, (STEPS, BYTES))
    yield Entry("solidsph/history", _TABLE, (STEPS,), is_optional=True)
    for one in static_fields(d):
        kind = _WHOLE if one.name in ("ghost", "body") else _FLOAT
        yield Entry(f"{data}/{one.name}", kind, (N, *_width(one.components)))
    for tag in tags:
        yield Entry(f"{data}/{tag_name(tag)}", _WHOLE, (N,))
    for path in ("VTKHDF/Points", *(f"{data}/{name}" for name in fields)):
        yield Entry(path, _WHOLE, (ANY,), "components")
        yield Entry(path, _TEXT, (), "units")
        components = tuple(int(one) for one in tree.item(path).attrs["components"])
        if components not in ((), (d,), (d, d)):
            raise ValueError(f"{path}@components is {components}, none that {d} dimensions have")
        yield Entry(path, _FLOAT, (ROWS, *_width(components)))
    faces = tree.item("solidsph/faces", is_optional=True)
    if faces is None:
        return
    if not isinstance(faces, h5py.Group):
        raise ValueError("solidsph/faces is no group")
    for number in range(len(faces)):
        face = f"solidsph/faces/{number}"
        yield Entry(face, _TEXT, (), "name")
        yield Entry(f"{face}/particles", _WHOLE, (ANY,))
        count = len(tree.item(f"{face}/particles"))
        yield Entry(f"{face}/area_vectors", _FLOAT, (count, d))
        yield Entry(f"{face}/areas", _FLOAT, (count,))


def _width(components: tuple[int, ...]) -> tuple[int, ...]:
    """As `layout.padded` leaves it."""
    return (3 ** len(components),) if components else ()


def _check(tree: Tree, entry: Entry, sizes: Mapping[str, int]) -> None:
    item = tree.item(entry.path, is_optional=entry.is_optional)
    if item is None:
        return
    where = f"{entry.path}@{entry.attribute}" if entry.attribute else entry.path
    if entry.attribute:
        if entry.attribute not in item.attrs:
            if entry.is_optional:
                return
            raise ValueError(f"{where} is missing")
        held: Any = item.attrs.get_id(entry.attribute)
        if held.get_space().get_simple_extent_type() == h5py.h5s.NULL:
            raise ValueError(f"{where} is empty")
    elif not isinstance(item, h5py.Dataset):
        raise ValueError(f"{where} is no dataset")
    else:
        held = item
        _check_own_data(item, where)
    shape = (held.shape or ()) if held.shape is not None else (0,)
    if held.dtype.kind not in entry.kind or not _fits(shape, entry.shape, sizes):
        expected = tuple(sizes.get(str(one), one) for one in entry.shape)
        raise ValueError(
            f"{where} holds {held.dtype} of shape {shape} instead of {_WORDS[entry.kind]} of "
            f"shape {_shape_text(expected, entry.shape)}"
        )


def _fits(shape: Sequence[int], wanted: Sequence[int | str], sizes: Mapping[str, int]) -> bool:
    if len(shape) != len(wanted):
        return False
    for size, name in zip(shape, wanted, strict=True):
        expected = sizes.get(str(name), name)
        if name == ANY:
            continue
        if size != expected and not (name in _AT_LEAST and size > int(expected)):
            return False
    return True


def _shape_text(expected: Sequence[int | str], names: Sequence[int | str]) -> str:
    words = [
        f"at least {size}" if name in _AT_LEAST else str(size)
        for size, name in zip(expected, names, strict=True)
    ]
    return f"({', '.join(words)})"


@attrs.frozen
class Tree:
    """What a file holds, by path. No link is followed: it could lead out of the file."""

    file: Any
    _known: dict[str, Any] = attrs.field(factory=dict, init=False)

    def item(self, path: str, *, is_optional: bool = False) -> Any:
        """A group or a dataset; None if it is optional and missing.

        Raises:
            ValueError: it is missing, or a link to elsewhere.
        """
        if path not in self._known:
            above, _, name = path.rpartition("/")
            holder = self.item(above) if above else self.file
            link = holder.get(name, getlink=True) if isinstance(holder, h5py.Group) else None
            if link is None:
                if is_optional:
                    return None
                raise ValueError(f"{path} is missing")
            if not isinstance(link, h5py.HardLink):
                raise ValueError(f"{path} is a link, which is not followed")
            self._known[path] = holder[name]
        return self._known[path]


def _check_own_data(dataset: Any, where: str) -> None:
    """That its data are in this file, as many as it says."""
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"{where} has its data in another file, which is not read")
    if dataset.dtype.hasobject:
        raise ValueError(f"{where} holds {dataset.dtype}, which refers to other places")
    try:
        stored = dataset.id.get_storage_size()
    except HDF5_ERRORS:  # of a file that lost its end; what is left can be read
        return
    if dataset.nbytes > stored * _MOST_COMPRESSED:
        raise ValueError(f"{where} claims {dataset.nbytes:,} bytes, and holds {stored:,}")


def check_values(particles: Particles, times: Any, steps: Any) -> None:
    """That what is where it must be can also be so.

    Raises:
        ValueError: something cannot.
    """
    n = particles.count
    for name in ("positions", "volumes", "cells", "spacings", "area_vectors", "images"):
        if not np.isfinite(getattr(particles, name)).all():
            raise ValueError(f"{name} of the particles are not finite")
    for name, rows in particles.bodies.items():
        if not 0 <= rows.start <= rows.stop <= n:
            raise ValueError(f"body {name!r} has particles {rows.start} to {rows.stop} of {n}")
    for name, face in particles.faces.items():
        if ((face.particles < 0) | (face.particles >= n)).any():
            raise ValueError(f"face {name!r} has particles that there are not")
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise ValueError("VTKHDF/Steps/Values holds times that do not increase")
    if (np.asarray(steps) < 0).any():
        raise ValueError("solidsph/step holds numbers below 0")
