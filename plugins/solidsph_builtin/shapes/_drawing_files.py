"""Files of drawings: the lines in them, straight ones in place of curves."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.system.encoding import decoded
from solidsph_builtin.shapes._libraries import geometry_library

MOST_BYTES = 2**26
_MOST_POINTS = 1_000_000

# Part of the size of a drawing by which a line may miss a curve, and how many lines there are in
# place of one, at least and at most.
_SAG, _FEWEST, _MOST = 1e-5, 4, 1 << 14

# Cubic curves in place of an arc, with an error of 1e-9 of its radius.
_ARCS = 16

# Names of the units that DXF files know by number.
_DXF_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 14: "dm", 13: "um", 12: "nm"}


@attrs.frozen(eq=False)
class Line:
    """Points joined by straight edges."""

    points: Array  # (m, 2) in the unit of the file
    closed: bool
    group: str = ""  # what the file calls it


def read_lines(data: bytes, suffix: str, unit: str) -> list[Line]:
    """The lines in the content of a file whose name ends in `suffix`, such as ".svg".

    Raises:
        SceneError: the library that reads such files is not installed.
        ValueError: the content is something else, or says that it is in another `unit`.
    """
    if suffix not in _READERS:
        end = repr(suffix) if suffix else "nothing"
        known = ", ".join(name[1:] for name in _READERS)
        raise ValueError(f"no drawings end in {end}; use one of {known}")
    if not data:
        raise ValueError("it is empty")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        lines = [line for line in _READERS[suffix](data, unit) if len(line.points) > 1]
    if not lines:
        raise ValueError("there are no lines in it")
    count = sum(len(line.points) for line in lines)
    if count > _MOST_POINTS:
        raise ValueError(f"it has {count:,} points, at most {_MOST_POINTS:,} are taken")
    for line in lines:
        if not np.isfinite(line.points).all():
            raise ValueError(f"a line has points that are not finite, by {line.points[0].tolist()}")
    return lines


def _csv(data: bytes, unit: str) -> Iterator[Line]:
    """Rows of two coordinates; a blank line ends a ring."""
    ring: list[list[float]] = []
    for number, text in enumerate([*decoded(data).splitlines(), ""], start=1):
        row = text.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if row:
            try:
                x, y = map(float, row)
            except ValueError:
                raise ValueError(
                    f"line {number} is {text!r}; expected two coordinates, a blank line between "
                    "rings, and # before anything else"
                ) from None
            ring.append([x, y])
        elif ring and not text.strip():
            yield Line(np.array(ring), closed=True)
            ring = []


def _svg(data: bytes, unit: str) -> Iterator[Line]:
    """Shapes of an SVG drawing in its own coordinates, y upwards."""
    svg = geometry_library("svgelements")
    try:
        drawing = svg.SVG.parse(io.BytesIO(data), reify=True)
        back = ~svg.Matrix(drawing.viewbox_transform or "")
        paths = [
            (abs(svg.Path(element) * back), str(element.id or ""))
            for element in drawing.elements()
            if isinstance(element, svg.Shape) and element.values.get("display") != "none"
        ]
        box = drawing.viewbox
        top = 0.0 if box is None else float(box.y + box.height) + float(box.y)
        pieces = [
            (segments, name) for path, name in paths for segments in path.as_subpaths() if segments
        ]
    except Exception as cause:
        raise _unreadable("SVG", cause) from cause
    if not pieces:
        return
    corners = [point for part, _ in pieces for point in _corners(part)]
    size = float(np.ptp(np.array(corners), axis=0).max())
    for part, name in pieces:
        curves = [s for s in part if type(s).__name__ not in ("Move", "Close")]
        if not curves:
            continue
        runs = [_flattened(segment, _SAG * size) for segment in curves]
        points = np.concatenate([runs[0][:1], *(run[1:] for run in runs)])
        is_closed = any(type(s).__name__ == "Close" for s in part)
        yield Line(np.column_stack([points[:, 0], top - points[:, 1]]), is_closed, name)


def _corners(segments: Any) -> Iterator[tuple[float, float]]:
    for segment in segments:
        for end in (segment.start, segment.end):
            if end is not None:
                yield float(end.x), float(end.y)


def _flattened(segment: Any, sag: float) -> Array:
    """Points along a curve, so many that straight lines miss it by less than `sag`, (m, 2)."""
    count = 1 if type(segment).__name__ == "Line" else _FEWEST
    while True:
        places = np.linspace(0.0, 1.0, 2 * count + 1)
        points = np.array([[p.x, p.y] for p in map(segment.point, places.tolist())])
        off = points[1::2] - 0.5 * (points[:-1:2] + points[2::2])
        if count >= _MOST or np.linalg.norm(off, axis=1).max() <= sag:
            return points[::2]
        count *= 2


def _dxf(data: bytes, unit: str) -> Iterator[Line]:
    """Lines and curves of the model space of a DXF drawing, by their layer."""
    geometry_library("ezdxf")
    recover, disassemble = geometry_library("ezdxf.recover"), geometry_library("ezdxf.disassemble")
    make_path = geometry_library("ezdxf.path").make_path
    try:
        drawing, _ = recover.read(io.BytesIO(data))
        own = _DXF_UNITS.get(int(drawing.header.get("$INSUNITS", 0)))
        paths = []
        for entity in disassemble.recursive_decompose(drawing.modelspace()):
            try:
                paths.append((make_path(entity, segments=_ARCS), str(entity.dxf.layer)))
            except TypeError:  # text, hatches, dimensions
                continue
        ends = np.array([point for path, _ in paths for point in path.control_vertices()])
        size = float(np.ptp(ends[:, :2], axis=0).max()) if len(ends) else 1.0
        lines = [
            (np.array([(p.x, p.y) for p in path.flattening(_SAG * size)]), path.is_closed, layer)
            for path, layer in paths
        ]
    except Exception as cause:
        raise _unreadable("DXF", cause) from cause
    if own is not None and own != unit:
        raise ValueError(f"it says that it is in {own}; set unit = {own!r}, and scale if it is not")
    for points, is_closed, layer in lines:
        yield Line(points, is_closed, "" if layer == "0" else layer)


def _unreadable(kind: str, cause: Exception) -> ValueError:
    said = f"{type(cause).__name__}: {cause}"
    return ValueError(f"it cannot be read as {kind} ({said}); is it complete, and of that kind?")


_READERS: Mapping[str, Callable[[bytes, str], Iterator[Line]]] = {
    ".csv": _csv,
    ".svg": _svg,
    ".dxf": _dxf,
}
