"""The spacing of a body as a scene states it: a number, a formula, a list, finer at some places, or
that with which its particles come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from numbers import Real
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Mask
from solidsph.maths.formulas import Expression
from solidsph.model.particles import Particles
from solidsph.model.regions import AXES, select
from solidsph.model.spacing import (
    MOST_RATIO,
    STEEPEST,
    STEEPEST_STEP,
    Cells,
    SpacingField,
    cells_over,
    smooth_step,
)
from solidsph.registry.construct import construct
from solidsph.scene.given_spacing import GIVEN, check_given, given_field, given_scaled
from solidsph.scene.listed_spacing import check_list, listed_spacing, with_factor
from solidsph.scene.scene_data import BodyScene

_KEYS = ("where", "spacing", "over")

# Cells at which a spacing is read, at most: then it is that of a body beyond any machine.
_MOST_CELLS = 2_000_000

# Places inside a region, at most, by which the distance from it is known.
_MOST_PLACES = 400_000

# A slope is read by differences over this part of the spacing, and may be too large by that of
# the third derivative.
_STEP, _ROUNDING = 1e-3, 1e-3


@attrs.frozen
class _Refinement:
    """One entry of `refine`."""

    where: str
    spacing: float  # [m]
    over: float  # distance over which the body's own spacing returns [m]


def is_graded(body: BodyScene) -> bool:
    """Whether the spacing of a body varies."""
    return isinstance(body.spacing, (str, Mapping)) or bool(body.refine)


def scaled(body: BodyScene, factor: float) -> BodyScene:
    """The body with its spacing times a factor everywhere.

    Where it would then grow too fast, it returns over a longer way.

    Raises:
        SceneError: its particles come with spacings.
    """
    if body.spacing == GIVEN:
        return given_scaled(body, factor)
    if isinstance(body.spacing, (str, Mapping)):
        own = body.spacing
        finer = f"{factor!r}*({own})" if isinstance(own, str) else with_factor(own, factor)
        refine = [{**entry, "spacing": factor * entry["spacing"]} for entry in body.refine]
        return attrs.evolve(body, spacing=finer, refine=tuple(refine))
    coarse = factor * body.spacing
    refine = []
    for entry in body.refine:
        fine = factor * entry["spacing"]
        over = max(entry["over"], _needed(fine, coarse))
        refine.append({**entry, "spacing": fine, "over": over})
    return attrs.evolve(body, spacing=coarse, refine=tuple(refine))


def least_spacing(body: BodyScene) -> float:
    """The smallest spacing of a body [m].

    Raises:
        SceneError: the spacing varies, and cannot be read.
    """
    if isinstance(body.spacing, (str, Mapping)):
        return spacing_field(body, construct("shapes", body.shape)).least
    return min([float(body.spacing), *(_refinement(entry).spacing for entry in body.refine)])


def check_words(body: BodyScene) -> None:
    """Raise SceneError if a spacing that varies cannot be read, whatever the shape."""
    if body.spacing == GIVEN:
        check_given(body)
    elif isinstance(body.spacing, str):
        Expression.parse(body.spacing, AXES)
    if isinstance(body.spacing, Mapping):
        check_list(body.spacing)
    for entry in body.refine:
        _refinement(entry)


def spacing_field(body: BodyScene, shape: Shape) -> SpacingField:
    """The spacing of a body that varies.

    Raises:
        SceneError: it is not positive and finite, or grows too fast, or a place to refine is wrong.
    """
    if body.spacing == GIVEN:
        return given_field(body, shape)
    entries = [_refinement(entry) for entry in body.refine]
    base = _base(body.spacing, shape)
    if not entries:
        return _checked(base, body, shape)
    if isinstance(body.spacing, (str, Mapping)):
        coarse = _checked(base, body, shape).greatest
    else:
        coarse = float(body.spacing)
    for entry in entries:
        _check_slope(entry, coarse)
    finer = [(entry, _distance(entry, shape, coarse)) for entry in entries]

    def wanted(X: Array) -> Array:
        least = s = base(X)
        for entry, distance in finer:
            way = smooth_step(distance(X) / entry.over)
            least = np.minimum(least, entry.spacing + way * (s - entry.spacing))
        return least

    return _checked(wanted, body, shape)


def predicted_count(field: SpacingField, shape: Shape) -> float:
    """Number of particles of a body with this spacing, about, if they stand on its surface."""
    cells = _cells(field.wanted, shape)
    inside = float(np.sum(cells.volumes / field.at(cells.centres) ** shape.dimension))
    surface = shape.surface(field.least)
    areas = np.linalg.norm(surface.area_vectors, axis=1)
    # Particles stand on the surface, half a cell beyond the middle of those of a lattice.
    return inside + 0.5 * float(np.sum(areas / field.at(surface.points) ** (shape.dimension - 1)))


def _base(spacing: float | str | Mapping[str, Any], shape: Shape) -> Callable[[Array], Array]:
    """What `spacing` says, at X (n, d), (n,) [m]."""
    if isinstance(spacing, Mapping):
        return listed_spacing(spacing, *shape.bounds())
    if not isinstance(spacing, str):
        number = _length("spacing", spacing)
        return lambda X: np.full(len(X), number)
    axes = AXES[: shape.dimension]
    formula = Expression.parse(spacing, axes)

    def values(X: Array) -> Array:
        own = dict(zip(axes, X.T, strict=True))
        return np.array(np.broadcast_to(formula(own), len(X)), dtype=np.float64)

    return values


def _checked(spacing: Callable[[Array], Array], body: BodyScene, shape: Shape) -> SpacingField:
    """That spacing, with the range that it keeps to within a shape.

    Raises:
        SceneError: it grows too fast, or is far too small for the shape.
    """
    cells = _cells(spacing, shape)
    low, high = shape.bounds()
    X = np.concatenate([cells.centres, shape.surface(float((high - low).min()) / 8.0).points])
    s = spacing(X)
    _check_values(X, s)
    least, greatest, worst = float(s.min()), float(s.max()), int(np.argmin(s))
    if np.any(cells.sizes > 2.0 * s[: len(cells.sizes)]):
        raise SceneError(
            f"the spacing is {least:.3g} m at {_place(X[worst])}, where it varies for some "
            f"{_MOST_CELLS:.0e} particles at most; use larger spacings, or check the unit of the "
            "shape"
        )
    if greatest > MOST_RATIO * least:
        raise SceneError(
            f"the spacing is {least:.3g} m at {_place(X[worst])} and {greatest:.3g} m elsewhere; "
            f"it may vary by a factor of {MOST_RATIO:g} in one body"
        )
    if isinstance(body.spacing, str):  # the growth of the others is limited by what they are
        _check_growth(spacing, cells)
    return SpacingField(spacing, least, greatest)


def _cells(spacing: Callable[[Array], Array], shape: Shape) -> Cells:
    """Cells of a shape about as large as the spacing."""

    def reaches(centres: Array, half_diagonals: Array) -> Mask:
        return np.asarray(shape.signed_distance(centres) < half_diagonals)

    def known(X: Array) -> Array:
        # A cell's centre may be outside, where a formula has no value.
        found = spacing(X)
        valid = np.isfinite(found) & (found > 0.0)
        return np.where(valid, found, np.median(found[valid]) if valid.any() else inf)

    found = cells_over(*shape.bounds(), known, reaches, most=_MOST_CELLS)
    own = shape.signed_distance(found.centres) <= 0.0
    return Cells(found.centres[own], found.sizes[own])


def _check_values(X: Array, s: Array) -> None:
    wrong = np.flatnonzero(~(np.isfinite(s) & (s > 0.0)))
    if wrong.size:
        raise SceneError(
            f"the spacing is {s[wrong[0]]:.4g} m at {_place(X[wrong[0]])}; it must be positive and "
            "finite everywhere in the body"
        )


def _check_growth(spacing: Callable[[Array], Array], cells: Cells) -> None:
    X, d = cells.centres, cells.centres.shape[1]
    s = spacing(X)
    if not len(X):
        return
    squares = np.zeros(len(X))
    for axis in np.eye(d):
        step = _STEP * s[:, None] * axis
        squares += ((spacing(X + step) - spacing(X - step)) / (2.0 * _STEP * s)) ** 2
    worst = int(np.argmax(squares))
    growth = float(np.sqrt(squares[worst]))
    if growth > STEEPEST * (1.0 + _ROUNDING):
        raise SceneError(
            f"the spacing grows by {growth:.3g} m per metre at {_place(X[worst])}, where it is "
            f"{s[worst]:.4g} m; at most {STEEPEST:g} keeps neighbours alike: let it grow more "
            "slowly, over a longer way"
        )


def _refinement(entry: Any) -> _Refinement:
    what = "refine"
    if not isinstance(entry, Mapping) or set(entry) != set(_KEYS):
        raise SceneError(
            f"{what}: each entry is {{where = ..., spacing = ..., over = ...}}, got {entry!r}"
        )
    if not isinstance(entry["where"], str):
        raise SceneError(f"{what}: where must be a face or a condition, got {entry['where']!r}")
    lengths = [_length(f"{what}: {name}", entry[name]) for name in ("spacing", "over")]
    return _Refinement(entry["where"], *lengths)


def _check_slope(entry: _Refinement, coarse: float) -> None:
    if entry.spacing > coarse:
        raise SceneError(
            f"refine at {entry.where!r}: spacing = {entry.spacing:g} m is above the largest of the "
            f"body, {coarse:.4g} m; it must be finer"
        )
    needed = _needed(entry.spacing, coarse)
    if entry.over < needed * (1.0 - _ROUNDING):
        raise SceneError(
            f"refine at {entry.where!r}: from {entry.spacing:g} to {coarse:.4g} m over "
            f"{entry.over:g} m the spacing grows too fast for neighbours to be alike; use over = "
            f"{_rounded_up(needed):g} or more"
        )


def _needed(fine: float, coarse: float) -> float:
    """Least distance over which a spacing may return from fine to coarse [m]."""
    return STEEPEST_STEP * (coarse - fine) / STEEPEST


def _distance(entry: _Refinement, shape: Shape, coarse: float) -> Callable[[Array], Array]:
    """The distance (n,) [m] of places (n, d) from where an entry refines."""
    places = _places(shape, max(entry.spacing, 0.02 * entry.over), coarse)
    tree = cKDTree(places.positions[select(places, entry.where)])

    def distance(X: Array) -> Array:
        return np.asarray(tree.query(X, distance_upper_bound=entry.over)[0])

    return lambda X: np.minimum(distance(X), entry.over)


def _places(shape: Shape, fine: float, coarse: float) -> Particles:
    """Samples of the surface, with their faces as tags, and of the inside."""
    surface = shape.surface(fine)
    lower, upper = shape.bounds()
    lengths = upper - lower
    step = max(fine, float(np.prod(lengths) / _MOST_PLACES) ** (1.0 / len(lengths)))
    axes = [
        low + (np.arange(count) + 0.5) * length / count
        for low, length, count in zip(
            lower, lengths, np.maximum(1, np.ceil(lengths / step)).astype(np.intp), strict=True
        )
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(lengths))
    inner = grid[shape.signed_distance(grid) < 0.0]
    positions = np.concatenate([surface.points, inner])
    n, outer = len(positions), len(surface.points)
    names, none = np.array(surface.faces), np.zeros(n, dtype=np.bool_)
    on_surface = np.arange(n) < outer
    tags = {"surface": on_surface, "interior": ~on_surface}
    for name in dict.fromkeys(surface.faces):
        tags[name] = none.copy()
        tags[name][:outer] = names == name
    return Particles(
        positions=positions,
        volumes=np.ones(n),
        spacings=np.full(n, coarse),
        area_vectors=np.zeros_like(positions),
        ghosts=none,
        images=positions,
        tags=tags,
    )


def _length(what: str, value: Any) -> float:
    number = isinstance(value, Real) and not isinstance(value, bool)
    if not (number and 0.0 < value < inf):
        raise SceneError(f"{what} must be a positive finite length in m, got {value!r}")
    return float(value)


def _rounded_up(length: float) -> float:
    """`length` with two digits, none smaller."""
    digit = 10.0 ** (np.floor(np.log10(length)) - 1.0)
    return float(f"{np.ceil(length / digit * (1.0 - 1e-9)) * digit:.2g}")


def _place(X: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in X) + ")"
