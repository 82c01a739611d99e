"""The spacing between points that come with one each."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.maths.arrays import Array
from solidsph.model.pair_search import PairSearch
from solidsph.model.spacing import MOST_RATIO, STEEPEST, SpacingField
from solidsph_builtin.discretisations._checks import refusal

# Points that a value is found from, by dimension: the neighbours along and across in a lattice.
_NEAR = {1: 3, 2: 9, 3: 19}

# In these parts of the furthest of them a point is where the value is asked for.
_SAME = 1e-9

# Points closer than this, in spacings, are neighbours whose spacings must be alike: those along a
# lattice, and across a cell.
_NEIGHBOURS = 1.5

# Spacings are given with a few digits.
_ROUNDING = 1e-2

# Nearest neighbours are usually a spacing apart; if most are not by this factor, the unit is wrong.
_ABSURD = 4.0


def spacing_of_points(
    discretisation: Discretisation, positions: Array, spacings: Array
) -> SpacingField:
    """The spacing at any place, from that of the points near it; at a point it is its own.

    Their weights are ((R - r) / (R r))^2, with R the distance of the furthest of them (Franke and
    Nielson 1980, Int. J. Numer. Meth. Engng 15, 1691-1704).

    Args:
        discretisation: the part that messages name.
        positions: of the points, (n, d) [m].
        spacings: of the points, (n,) [m].

    Raises:
        SceneError: a spacing is not positive, they are far from the distances of the points, or
            those of neighbours are too different.
    """
    _check_values(discretisation, positions, spacings)
    tree = cKDTree(positions)
    count = min(_NEAR[positions.shape[1]], len(positions))
    if count > 1:
        _check_scale(discretisation, tree, spacings)
        _check_growth(discretisation, positions, spacings)

    def values(X: Array) -> Array:
        r, near = (found.reshape(len(X), count) for found in map(np.asarray, tree.query(X, count)))
        furthest = r[:, -1:]
        w = ((furthest - r) / np.maximum(r, _SAME * furthest + (furthest == 0.0))) ** 2
        same = (r[:, 0] <= _SAME * furthest[:, 0]) | ~w.any(axis=1)
        w[same] = np.arange(count) == 0
        found: Array = np.sum(w * spacings[near], axis=1) / w.sum(axis=1)
        return found

    return SpacingField(values, float(spacings.min()), float(spacings.max()))


def _check_values(discretisation: Discretisation, positions: Array, spacings: Array) -> None:
    wrong = np.flatnonzero(~(spacings > 0.0))
    if wrong.size:
        raise refusal(
            discretisation,
            f"the spacing of point {wrong[0]} is {spacings[wrong[0]]:g} m; it must be positive "
            f"({wrong.size} of {len(spacings)} are not)",
        )
    least, greatest = float(spacings.min()), float(spacings.max())
    if greatest > MOST_RATIO * least:
        raise refusal(
            discretisation,
            f"the spacings are {least:.3g} to {greatest:.3g} m; they may vary by a factor of "
            f"{MOST_RATIO:g} in one body",
        )


def _check_scale(discretisation: Discretisation, tree: cKDTree, spacings: Array) -> None:
    apart = float(np.median(np.asarray(tree.query(tree.data, 2)[0])[:, 1] / spacings))
    if not 1.0 / _ABSURD < apart < _ABSURD:
        raise refusal(
            discretisation,
            f"nearest points are {apart:.3g} of their spacings apart (the median), and should be "
            "about 1; check the unit of the column 'spacing'",
        )


def _check_growth(discretisation: Discretisation, positions: Array, spacings: Array) -> None:
    rows = np.arange(len(positions))
    p, q = PairSearch.of(positions, _NEIGHBOURS * spacings).near(rows)
    p, q = p[p < q], q[p < q]
    apart = np.linalg.norm(positions[p] - positions[q], axis=1)
    growth = np.abs(spacings[p] - spacings[q]) / np.maximum(apart, np.finfo(float).tiny)
    if growth.max(initial=0.0) <= STEEPEST * (1.0 + _ROUNDING):
        return
    worst = int(np.argmax(growth))
    a, b = sorted((int(p[worst]), int(q[worst])), key=lambda point: float(spacings[point]))
    raise refusal(
        discretisation,
        f"the spacing grows from {spacings[a]:.4g} m at point {a} to {spacings[b]:.4g} m at point "
        f"{b}, {apart[worst]:.4g} m away, which is {growth[worst]:.3g} m per metre; at most "
        f"{STEEPEST:g} keeps neighbours alike: let it grow more slowly, over a longer way",
    )
