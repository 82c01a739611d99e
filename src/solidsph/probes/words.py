"""Probes from the words of a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from math import isfinite
from typing import Any

from solidsph.errors import BuildError, SceneError
from solidsph.probes.at_points import FaceProbe, LineProbe, PointProbe
from solidsph.probes.probe import Probe
from solidsph.probes.quantities import RESULTANT, Measure
from solidsph.probes.resultants import AccountProbe, SurfaceProbe

_PLACES = ("point", "line", "where", "account")

_LINE = ("from", "to", "count")

# Points along a line if it does not say: their values are smooth between particles.
_COUNT = 101

_MOST_POINTS = 100_000


def probe_of(label: str, words: Mapping[str, Any]) -> Probe:
    """The probe that a scene describes.

    Args:
        label: its label.
        words: `quantity`; one of `point`, `line`, `where` and `account`; maybe `about` or `body`.
            Those that are not given are None.

    Raises:
        BuildError: with all its problems.
    """
    given = {name: value for name, value in words.items() if value is not None}
    problems = list(_misplaced(given))
    read: dict[str, Any] = {}
    for name, reader in (
        ("quantity", _quantity),
        ("point", _point),
        ("line", _line),
        ("account", _text),
        ("body", _text),
        ("about", _point),
    ):
        if name in given:
            try:
                read[name] = reader(name, given[name])
            except SceneError as cause:
                problems.append(str(cause))
    measure = read.get("quantity")
    if isinstance(measure, Measure) and ("line" in given or "where" in given):
        try:
            measure.check_single()
        except SceneError as cause:
            problems.append(str(cause))
    if problems:
        raise BuildError([f"probe {label!r}: {problem}" for problem in problems])
    if measure is None:  # a resultant
        if "account" in given:
            return AccountProbe(label, read["account"], read.get("about"))
        return SurfaceProbe(label, given["where"], read.get("about"))
    if "point" in given:
        return PointProbe(label, measure, read["point"], read.get("body"))
    if "line" in given:
        start, end, count = read["line"]
        return LineProbe(label, measure, start, end, count, read.get("body"))
    return FaceProbe(label, measure, given["where"])


def _misplaced(given: Mapping[str, Any]) -> Sequence[str]:
    """Problems of what is given together."""
    problems = []
    places = [name for name in _PLACES if name in given]
    wanted = ("where", "account") if given.get("quantity") == RESULTANT else _PLACES[:3]
    if not given.get("quantity"):
        problems.append("no quantity; add quantity = ..., such as 'displacement'")
    elif len(places) != 1 or places[0] not in wanted:
        got = " and ".join(places) or "none"
        problems.append(f"give one of {', '.join(wanted)} for {given['quantity']!r}, got {got}")
    if "about" in given and given.get("quantity") != RESULTANT:
        problems.append(f"about is the point of a moment; leave it out, or measure {RESULTANT!r}")
    if "body" in given and not {"point", "line"} & given.keys():
        problems.append("body belongs to a point or a line; leave it out")
    return problems


def _quantity(name: str, value: Any) -> Measure | None:
    """The measure; None for a resultant."""
    text = _text(name, value)
    return None if text == RESULTANT else Measure.of(text)


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise SceneError(f"{name} must be text, got {value!r}")
    return value


def _point(name: str, value: Any) -> tuple[float, ...]:
    try:
        point = tuple(float(x) for x in value if not isinstance(x, (bool, str)))
    except (TypeError, ValueError, OverflowError):
        point = ()
    if isinstance(value, (str, Mapping)) or not 1 <= len(point) == len(value) <= 3:
        point = ()
    if not point or not all(map(isfinite, point)):
        raise SceneError(
            f"{name} must be a list of coordinates in metres, such as [1.0, 0.5], got {value!r}"
        )
    return point


def _line(name: str, value: Any) -> tuple[tuple[float, ...], tuple[float, ...], int]:
    """Both ends of a line, and the number of points."""
    if not isinstance(value, Mapping) or not {"from", "to"} <= set(value):
        raise SceneError(
            f"{name} must be a table such as {{from = [0, 0], to = [1, 0], count = {_COUNT}}}, "
            f"got {value!r}"
        )
    for key in value:
        if key not in _LINE:
            near = get_close_matches(str(key), _LINE, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(_LINE)}"
            raise SceneError(f"{name} has an unknown key {key!r}; {hint}")
    start, end = _point(f"{name}: from", value["from"]), _point(f"{name}: to", value["to"])
    if len(start) != len(end) or start == end:
        raise SceneError(f"{name} must join two points, got {list(start)} and {list(end)}")
    count = value.get("count", _COUNT)
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= _MOST_POINTS:
        raise SceneError(
            f"{name}: count must be a whole number from 2 to {_MOST_POINTS}, got {count!r}"
        )
    return start, end, count
