"""Checks that a file has the layout of a record: entries, types and shapes.

`layout` says what each entry means; here is what the reader relies on, as one table. What only VTK
reads is not checked. A file that does not fit gives a `ValueError` that says where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.model.particles import Particles
from solidsph.results.contents import BYTES
from solidsph.results.layout import FORMAT, HDF5_ERRORS, TAGS, static_fields, tag_name

ANY = "any"  # size

_FLOAT, _WHOLE, _TEXT, _TABLE = "f", "iu", "S", "V"
_WORDS = {_FLOAT: "real numbers", _WHOLE: "whole numbers", _TEXT: "texts", _TABLE: "a table"}
_LARGEST_DIMENSION = 3

# Bound on the factor by which compression makes data smaller; for zeros it is about a thousand.
_MOST_COMPRESSED = 1100


@attrs.frozen
class Entry:
    """A dataset, or an attribute of a dataset or a group."""

    path: str
    kind: str  # kinds of NumPy's data types
    shape: tuple[int | str, ...]
    attribute: str = ""  # its name; empty for the dataset itself
    is_optional: bool = False
    may_have_more_rows: bool = False  # since the run goes on

    @property
    def where(self) -> str:
        """Place in the file, as messages name it."""
        return f"{self.path}@{self.attribute}" if self.attribute else self.path

    def fits(self, shape: tuple[int, ...]) -> bool:
        """True if `shape` is allowed."""
        if self.may_have_more_rows and shape:
            shape = (min(shape[0], int(self.shape[0])), *shape[1:])
        return len(shape) == len(self.shape) and all(
            wanted in (ANY, size) for size, wanted in zip(shape, self.shape, strict=True)
        )


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
    Entry("solidsph/error_bars", _TABLE, (ANY,), is_optional=True),
    Entry("solidsph/body_ranges", _WHOLE, (ANY, 2)),
    Entry("VTKHDF/PointData/volume", _FLOAT, (ANY,)),
)
"""Entries that say what else there is."""


def check_first(tree: Tree) -> None:
    """Raise ValueError unless the entries that say what else there is fit."""
    for entry in _FIRST:
        _check(tree, entry)
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
    """Raise ValueError unless everything else fits, for this number of steps."""
    for entry in _rest(tree, steps, fields, tags):
        _check(tree, entry)


def _rest(tree: Tree, steps: int, fields: Sequence[str], tags: Sequence[str]) -> Iterator[Entry]:
    d = int(tree.item("solidsph").attrs["dimension"])
    data, n = "VTKHDF/PointData", len(tree.item("VTKHDF/PointData/volume"))
    yield _growing("VTKHDF/Steps/Values", _FLOAT, (steps,))
    yield _growing("solidsph/step", _WHOLE, (steps,))
    yield _growing("solidsph/digests", _WHOLE, (steps, BYTES))
    old = tree.item("solidsph").attrs["format"] < FORMAT
    for field in static_fields(d):
        if old and field.name == TAGS:
            continue
        kind = _WHOLE if field.name in ("ghost", "body", TAGS) else _FLOAT
        yield Entry(f"{data}/{field.name}", kind, (n, *_width(field.components)))
    for path in (f"{data}/{tag_name(tag)}" for tag in tags):
        if old or tree.item(path, is_optional=True) is not None:
            yield Entry(path, _WHOLE, (n,))
    if not old:
        yield Entry("solidsph/bits", _TEXT, (ANY,))
    for path in ("VTKHDF/Points", *(f"{data}/{name}" for name in fields)):
        yield Entry(path, _WHOLE, (ANY,), "components")
        yield Entry(path, _TEXT, (), "units")
        components = tuple(int(size) for size in tree.item(path).attrs["components"])
        if components not in ((), (d,), (d, d)):
            raise ValueError(f"{path}@components is {components}, none that {d} dimensions have")
        yield _growing(path, _FLOAT, (n * steps, *_width(components)))
    history = tree.item("solidsph/history", is_optional=True)
    if history is not None:
        yield _growing("solidsph/history", _TABLE, (steps,))
        columns = history.dtype
        if any(columns[i].kind != _FLOAT for i in range(len(columns.names or ()))):
            raise ValueError("solidsph/history has a column that holds no real numbers")
        yield Entry("solidsph/history", _TEXT, (len(columns.names or ()),), "units")
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


def _growing(path: str, kind: str, shape: tuple[int, ...]) -> Entry:
    return Entry(path, kind, shape, may_have_more_rows=True)


def _width(components: tuple[int, ...]) -> tuple[int, ...]:
    """Shape of a row after `layout.padded`."""
    return (3 ** len(components),) if components else ()


def _check(tree: Tree, entry: Entry) -> None:
    item = tree.item(entry.path, is_optional=entry.is_optional)
    if item is None:
        return
    held: Any = item
    if entry.attribute:
        if entry.attribute not in item.attrs:
            if entry.is_optional:
                return
            raise ValueError(f"{entry.where} is missing")
        held = item.attrs.get_id(entry.attribute)
        if held.get_space().get_simple_extent_type() == h5py.h5s.NULL:
            raise ValueError(f"{entry.where} is empty")
    elif not isinstance(item, h5py.Dataset):
        raise ValueError(f"{entry.where} is no dataset")
    else:
        _check_data(item, entry.where)
    shape = (held.shape or ()) if held.shape is not None else (0,)
    if held.dtype.kind not in entry.kind or not entry.fits(shape):
        wanted = ", ".join(map(str, entry.shape))
        least = "at least " if entry.may_have_more_rows else ""
        raise ValueError(
            f"{entry.where} holds {held.dtype} of shape {shape} instead of {_WORDS[entry.kind]} of "
            f"shape ({least}{wanted})"
        )


@attrs.frozen
class Tree:
    """Groups and datasets of a file, by path. Links are not followed: they could lead elsewhere."""

    file: Any
    _known: dict[str, Any] = attrs.field(factory=dict, init=False)

    def item(self, path: str, *, is_optional: bool = False) -> Any:
        """A group or a dataset; None if it is optional and missing, else ValueError."""
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


def _check_data(dataset: Any, where: str) -> None:
    """Check that its data are in this file, as many as it claims."""
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"{where} has its data in another file, which is not read")
    if dataset.dtype.hasobject:
        raise ValueError(f"{where} holds {dataset.dtype}, which refers to other places")
    try:
        stored = dataset.id.get_storage_size()
    except HDF5_ERRORS:  # the file has lost its end; what is left can be read
        return
    if dataset.nbytes > stored * _MOST_COMPRESSED:
        raise ValueError(f"{where} claims {dataset.nbytes:,} bytes, and holds {stored:,}")


def check_values(particles: Particles, times: Any, steps: Any) -> None:
    """Raise ValueError unless values make sense together."""
    n = particles.count
    for name in ("positions", "volumes", "cells", "spacings", "area_vectors", "images"):
        if not np.isfinite(getattr(particles, name)).all():
            raise ValueError(f"{name} of the particles are not finite")
    for name, rows in particles.bodies.items():
        if not 0 <= rows.start <= rows.stop <= n:
            raise ValueError(f"body {name!r} has particles {rows.start} to {rows.stop} of {n}")
    for name, face in particles.faces.items():
        if ((face.particles < 0) | (face.particles >= n)).any():
            raise ValueError(f"face {name!r} has particles that do not exist")
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise ValueError("VTKHDF/Steps/Values holds times that do not increase")
    if (np.asarray(steps) < 0).any():
        raise ValueError("solidsph/step holds numbers below 0")
