"""The spacing of a body as a scene states it: a number, a formula, a list, finer at some places, or
that with which its particles come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Mask
from solidsph.maths.formulas import Expression
from solidsph.model.regions import AXES
from solidsph.model.spacing import MOST_RATIO, STEEPEST, Cells, SpacingField, cells_over
from solidsph.registry.construct import construct
from solidsph.scene.given_spacing import GIVEN, check_given, given_field, given_scaled
from solidsph.scene.listed_spacing import check_list, listed_spacing, with_factor
from solidsph.scene.refine_entries import AtRegion, length_of, refinement
from solidsph.scene.scene_data import BodyScene

# Cells at which a spacing is read, at most: then it is that of a body beyond any machine.
_MOST_CELLS = 2_000_000

# A slope is read by differences over this part of the spacing, and may be too large by that of
# the third derivative.
_STEP, _ROUNDING = 1e-3, 1e-3


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
    own = body.spacing
    spacing: float | str | Mapping[str, Any]
    if isinstance(own, str):
        spacing = f"{factor!r}*({own})"
    else:
        spacing = with_factor(own, factor) if isinstance(own, Mapping) else factor * own
    entries = [refinement(entry) for entry in body.refine]
    refine: tuple[Mapping[str, Any], ...] = ()
    if entries:
        coarse = _greatest(body, construct("shapes", body.shape))
        refine = tuple(entry.scaled(factor, coarse) for entry in entries)
    return attrs.evolve(body, spacing=spacing, refine=refine)


def least_spacing(body: BodyScene) -> float:
    """The smallest spacing of a body [m].

    Raises:
        SceneError: the spacing varies, and cannot be read.
    """
    entries = [refinement(entry) for entry in body.refine]
    known = [entry.spacing for entry in entries if isinstance(entry, AtRegion)]
    if isinstance(body.spacing, (str, Mapping)) or len(known) < len(entries):
        return spacing_field(body, construct("shapes", body.shape)).least
    return min([float(body.spacing), *known])


def check_words(body: BodyScene) -> None:
    """Raise SceneError if a spacing that varies cannot be read, whatever the shape."""
    if body.spacing == GIVEN:
        check_given(body)
    elif isinstance(body.spacing, str):
        Expression.parse(body.spacing, AXES)
    if isinstance(body.spacing, Mapping):
        check_list(body.spacing)
    for entry in body.refine:
        refinement(entry)


def spacing_field(body: BodyScene, shape: Shape) -> SpacingField:
    """The spacing of a body that varies.

    Raises:
        SceneError: it is not positive and finite, or grows too fast, or a place to refine is wrong.
    """
    if body.spacing == GIVEN:
        return given_field(body, shape)
    entries = [refinement(entry) for entry in body.refine]
    base = _base(body.spacing, shape)
    if not entries:
        return _checked(base, body, shape)
    coarse = _greatest(body, shape)
    places = [place for entry in entries for place in entry.places(shape, coarse)]

    def wanted(X: Array) -> Array:
        least = base(X)
        for place in places:
            least = np.minimum(least, place.at(X))
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


def _greatest(body: BodyScene, shape: Shape) -> float:
    """The largest spacing of a body, wherever it is refined [m]."""
    if isinstance(body.spacing, (str, Mapping)):
        return _checked(_base(body.spacing, shape), body, shape).greatest
    return float(body.spacing)


def _base(spacing: float | str | Mapping[str, Any], shape: Shape) -> Callable[[Array], Array]:
    """What `spacing` says, at X (n, d), (n,) [m]."""
    if isinstance(spacing, Mapping):
        return listed_spacing(spacing, *shape.bounds())
    if not isinstance(spacing, str):
        number = length_of("spacing", spacing)
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


def _place(X: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in X) + ")"
