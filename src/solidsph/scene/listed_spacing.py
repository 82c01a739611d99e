"""The spacing of a body as a file lists it, place by place.

Between the listed places it is linear, in the triangles or tetrahedra that they make (Delaunay
1934); beyond them it is that of the nearest. Where the list would let it grow too fast, it is finer
than listed.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import combinations, product
from math import inf
from numbers import Real
from pathlib import Path
from reprlib import repr as short
from typing import Any

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay, cKDTree

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array, Indices
from solidsph.model.regions import AXES
from solidsph.model.spacing import STEEPEST
from solidsph.scene.named_files import FILE
from solidsph.system.encoding import decoded, is_number
from solidsph.system.files import content, located

FACTOR = "factor"
"""The key whose value all listed spacings are multiplied by."""

SPACING = "spacing"
"""The heading of the last column."""

_MOST_BYTES = 2**30
_KEPT = 8  # lists, of a scene with so many bodies


def with_factor(listed: Mapping[str, Any], factor: float) -> Mapping[str, Any]:
    """The same list with all spacings times a factor."""
    return {**listed, FACTOR: factor * listed.get(FACTOR, 1.0)}


def check_list(listed: Mapping[str, Any]) -> None:
    """Raise SceneError if a table names no list, whatever the file holds."""
    if FILE not in listed or set(listed) - {FILE, FACTOR}:
        raise SceneError(
            f"spacing: it is a number, a formula, or {{file = ...}}, maybe with a factor; got "
            f"{dict(listed)!r}"
        )
    if not isinstance(listed[FILE], str):
        raise SceneError(f"spacing: file must be the name of a file, got {listed[FILE]!r}")
    factor = listed.get(FACTOR, 1.0)
    number = isinstance(factor, Real) and not isinstance(factor, bool)
    if not (number and 0.0 < factor < inf):
        raise SceneError(f"spacing: factor must be positive and finite, got {factor!r}")


def listed_spacing(
    listed: Mapping[str, Any], lower: Array, upper: Array
) -> Callable[[Array], Array]:
    """The spacing (n,) [m] at X (n, d) of a body between two corners (d,), by a list in a file.

    Raises:
        SceneError: the file cannot be read, or a line of it is wrong.
    """
    check_list(listed)
    path = Path(listed[FILE])
    try:
        data = content(located(path), _MOST_BYTES)
    except OSError as cause:
        raise SceneError(f"spacing: the file {str(path)!r} cannot be read: {cause}") from None
    try:
        return _field(
            data, float(listed.get(FACTOR, 1.0)), tuple(lower.tolist()), tuple(upper.tolist())
        )
    except ValueError as cause:
        raise SceneError(f"spacing: the file {str(path)!r}: {cause}") from None


def list_of(places: Array, spacings: Array) -> str:
    """The text of a list of places (n, d) [m] and spacings (n,) [m]."""
    heading = ",".join([*AXES[: places.shape[1]], SPACING])
    rows = np.column_stack([places, spacings]).tolist()
    return "\n".join([heading, *(",".join(f"{x:.9g}" for x in row) for row in rows), ""])


@lru_cache(_KEPT)
def _field(
    data: bytes, factor: float, lower: tuple[float, ...], upper: tuple[float, ...]
) -> Callable[[Array], Array]:
    """What a list says; kept, since building a scene asks for it several times."""
    d = len(lower)
    places, spacings = _read(decoded(data), d)
    # What grows slowly enough still does so when it is made finer.
    slope = min(factor, 1.0) * STEEPEST / np.sqrt(d)
    if d == 1:
        order = np.argsort(places[:, 0])
        x = places[order, 0]
        edges = np.stack([np.arange(len(x) - 1), np.arange(1, len(x))], axis=1)
        s = _limited(x[:, None], factor * spacings[order], edges, slope)
        return lambda X: np.interp(X[:, 0], x, s)
    corners = _corners(places, np.array(lower), np.array(upper))
    cells = Delaunay(np.concatenate([places, corners]))
    edges = np.concatenate([cells.simplices[:, [a, b]] for a, b in combinations(range(d + 1), 2)])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    edges = edges[edges.max(axis=1) < len(places)]
    s = _limited(places, factor * spacings, edges, slope)
    tree = cKDTree(places)
    between = LinearNDInterpolator(cells, np.concatenate([s, s[tree.query(corners)[1]]]))

    def spacing(X: Array) -> Array:
        found = between(X)
        flat = ~np.isfinite(found)  # beyond the corners, or in a tetrahedron without a volume
        found[flat] = s[tree.query(X[flat])[1]]
        return np.clip(found, s.min(), s.max())  # rounding would make one spacing many

    return spacing


def _corners(places: Array, lower: Array, upper: Array) -> Array:
    """Corners of a box around the body and all places, as far away as these are from each other,
    (2^d, d)."""
    low, high = np.minimum(lower, places.min(axis=0)), np.maximum(upper, places.max(axis=0))
    size = float((high - low).max())
    return np.array(list(product(*zip(low - size, high + size, strict=True))))


def _limited(places: Array, spacings: Array, edges: Indices, slope: float) -> Array:
    """The largest spacings, none above those given, that grow by no more than a `slope` along
    `edges` (m, 2) between places (n, d), (n,) [m]: the shortest ways from a place beside them all,
    to which each is as far as its spacing."""
    n = len(places)
    a, b = edges.T
    growth = slope * np.linalg.norm(places[a] - places[b], axis=1)
    rows, columns = np.concatenate([a, np.full(n, n)]), np.concatenate([b, np.arange(n)])
    ways = csr_array((np.concatenate([growth, spacings]), (rows, columns)), shape=(n + 1, n + 1))
    found: Array = dijkstra(ways, directed=False, indices=np.array([n]))[0, :n]
    return found


def _read(text: str, dimension: int) -> tuple[Array, Array]:
    """Places (n, d) [m], each once, and the least spacing listed for each, (n,) [m].

    Raises:
        ValueError: there are no such rows.
    """
    names = [*AXES[:dimension], SPACING]
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    first = next(filter(None, lines), "")
    heading = [word.partition("[")[0].strip() for word in first.split(",")]
    columns = f"its columns must be {', '.join(names)}, in metres"
    if heading == names:
        lines[lines.index(first)] = ""
    elif first and not any(map(is_number, heading)):
        raise ValueError(f"{columns}, got the heading {short(first)}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of an empty file
        rows = np.loadtxt(io.StringIO("\n".join(lines)), delimiter=",", ndmin=2)
    if not len(rows):
        raise ValueError(f"it lists no place; {columns}")
    if rows.shape[1] != len(names):
        raise ValueError(f"{columns}, got {rows.shape[1]} columns")
    wrong = np.flatnonzero(~(np.isfinite(rows).all(axis=1) & (rows[:, -1] > 0.0)))
    if wrong.size:
        raise ValueError(
            f"place {wrong[0] + 1} is {rows[wrong[0]].tolist()}; all must be finite, and the "
            "spacing positive"
        )
    places, which = np.unique(rows[:, :-1], axis=0, return_inverse=True)
    spacings = np.full(len(places), inf)
    np.minimum.at(spacings, which, rows[:, -1])
    return places, spacings
