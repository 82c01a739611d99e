"""Rings: closed lines made of lines that follow each other, with the body on their left."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._drawing_files import Line
from solidsph_builtin.shapes._outline import ClosedLines, first_crossing, next_of
from solidsph_builtin.shapes._patches import tag_of

# Ends closer than this part of the size of the drawing meet.
_MEET = 1e-6


@attrs.frozen(eq=False)
class Ring:
    """A closed line."""

    corners: Array  # (m, 2), each joined to the next, the last to the first
    groups: Sequence[str]  # (m,) of the edge that begins at each corner; empty for none


def rings_of(lines: Sequence[Line]) -> list[Ring]:
    """The rings that lines make up, outlines counterclockwise and holes clockwise.

    Raises:
        ValueError: a line has a loose end, edges cross or touch, or nothing is enclosed.
    """
    everything = np.concatenate([line.points for line in lines])
    size = float(np.ptp(everything, axis=0).max())
    closed, loose = [], []
    for line in lines:
        is_ring = np.linalg.norm(line.points[0] - line.points[-1]) <= _MEET * size
        points = line.points[:-1] if is_ring else line.points
        if is_ring or line.closed:
            closed.append(Ring(points, [line.group] * len(points)))
        else:
            loose.append(line)
    found = [_without_repeats(ring, _MEET * size) for ring in [*closed, *_joined(loose, size)]]
    for ring in found:
        if len(ring.corners) < 3 or abs(_area(ring.corners)) <= 1e-12 * size**2:
            place = ", ".join(f"{x:.4g}" for x in ring.corners[0])
            raise ValueError(f"the line at ({place}) encloses no area; remove it")
    _check_crossings(found)
    return [_turned(ring, found) for ring in found]


def _joined(lines: Sequence[Line], size: float) -> list[Ring]:
    """Rings of lines that meet at their ends."""
    left, rings = list(lines), []
    while left:
        points, groups = left[0].points, [left[0].group] * (len(left[0].points) - 1)
        left.pop(0)
        while np.linalg.norm(points[-1] - points[0]) > _MEET * size:
            gaps = [
                min(np.linalg.norm(line.points[end] - points[-1]) for end in (0, -1))
                for line in left
            ]
            nearest = int(np.argmin(gaps)) if gaps else -1
            if not gaps or gaps[nearest] > _MEET * size:
                place = ", ".join(f"{x:.6g}" for x in points[-1])
                least = min([*gaps, np.linalg.norm(points[-1] - points[0])])
                raise ValueError(
                    f"it is not closed: a line ends at ({place}), in the unit of the file, and the "
                    f"nearest end is {least:.3g} away; close it where it was drawn"
                )
            line = left.pop(nearest)
            backwards = np.linalg.norm(line.points[0] - points[-1]) > _MEET * size
            more = line.points[::-1] if backwards else line.points
            points = np.concatenate([points, more[1:]])
            groups += [line.group] * (len(more) - 1)
        rings.append(Ring(points[:-1], groups))
    return rings


def _without_repeats(ring: Ring, distance: float) -> Ring:
    steps = np.linalg.norm(np.roll(ring.corners, -1, axis=0) - ring.corners, axis=1)
    kept = np.flatnonzero(steps > distance)
    return Ring(ring.corners[kept], [ring.groups[n] for n in kept.tolist()])


def _check_crossings(rings: Sequence[Ring]) -> None:
    starts = np.concatenate([ring.corners for ring in rings])
    pair = first_crossing(starts, next_of([ring.corners for ring in rings]))
    if pair is not None:
        place = ", ".join(f"{x:.6g}" for x in starts[pair[1]])
        raise ValueError(
            f"two of its edges cross or touch, one of them from ({place}), in the unit of the "
            "file; draw the outline of the whole, or use one file for each part"
        )


def _turned(ring: Ring, rings: Sequence[Ring]) -> Ring:
    """The ring with the body on its left: inside an odd number of others it is a hole."""
    depth = sum(
        bool(_one(other.corners).signed_distance(ring.corners[:1])[0] < 0.0)
        for other in rings
        if other is not ring
    )
    if (_area(ring.corners) > 0.0) == (depth % 2 == 0):
        return ring
    # The edge that begins at a corner is then the one that ended there.
    return Ring(ring.corners[::-1], [*ring.groups[-2::-1], ring.groups[-1]])


def _one(corners: Array) -> ClosedLines:
    return ClosedLines.of([corners if _area(corners) > 0.0 else corners[::-1]])


def _area(corners: Array) -> float:
    x, y = (corners - corners[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def edge_names(rings: Sequence[Ring], angle: float) -> list[str]:
    """The face of each edge of the rings, (m,).

    The edges of a group are a face. Others are parted at corners that turn by more than an `angle`
    [degrees], into edge-1, edge-2 and so on, from the first corner of each ring.
    """
    given = {tag_of(group) for ring in rings for group in ring.groups if group}
    names: list[str] = []
    count = 0
    for ring in rings:
        ways = np.roll(ring.corners, -1, axis=0) - ring.corners
        ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
        # Whether something begins at each corner.
        before = np.roll(ways, 1, axis=0)
        begins = np.einsum("mi,mi->m", ways, before) < np.cos(np.radians(angle))
        groups = np.array(ring.groups, dtype=object)
        begins |= groups != np.roll(groups, 1)
        first = int(np.argmax(begins))
        number = np.cumsum(np.roll(begins, -first)) - int(begins.any())
        own: dict[int, str] = {}
        ring_names = []
        for place, group in zip(number.tolist(), np.roll(groups, -first).tolist(), strict=True):
            if not group and place not in own:
                count += 1
                while f"edge-{count}" in given:
                    count += 1
                own[place] = f"edge-{count}"
            ring_names.append(tag_of(group) if group else own[place])
        names += [*ring_names[len(ring_names) - first :], *ring_names[: len(ring_names) - first]]
    return names
