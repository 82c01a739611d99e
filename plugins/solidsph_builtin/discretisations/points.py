"""Points: particles wherever the user wants them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from reprlib import repr as short
from typing import Any, ClassVar

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField
from solidsph_builtin.discretisations._checks import check_spacing, refusal
from solidsph_builtin.discretisations._fitting import ON_BOUNDARY, fitted, lighter_on_surface
from solidsph_builtin.discretisations._graded_fitting import graded_fit
from solidsph_builtin.discretisations._grid import grid_over
from solidsph_builtin.discretisations._nearest import Assignment, nearest
from solidsph_builtin.discretisations._point_spacing import spacing_of_points
from solidsph_builtin.discretisations._point_table import (
    SPACING,
    VOLUME,
    PointTable,
    check_columns,
    point_table,
    read_rows,
)
from solidsph_builtin.discretisations._surface import faces, sampled, without_ghosts

# Closer than this, in spacings, two points coincide; a point outside by less than this is inside.
_TOLERANCE = 1e-6
# A point is on the surface up to this depth, in spacings: nodes of a mesh stand on its facets, and
# files hold few digits. Up to here 'consistent' errs less than 'corrected' in bending and torsion.
_ON_SURFACE = 0.1
# Median distance of nearest points, in spacings, from which on volumes are fitted: 0.65 where those
# of a lattice are moved by up to half a spacing.
_APART = 0.5
# Samples along a spacing from which the volumes nearest to points are found, for each dimension.
# Even, so that none lies half way between two points of a lattice.
_SAMPLES = {1: 64, 2: 8, 3: 4}
_CHUNK = 1 << 16


def _as_array(value: Any) -> Any:
    """Numbers as a read-only copy; anything else unchanged, for the check to refuse."""
    if value is None:
        return None
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return value
    array.setflags(write=False)
    return array


def _as_tuple(value: Any) -> Any:
    """A list as a tuple; anything else unchanged, for the check to refuse."""
    return tuple(value) if isinstance(value, list) else value


@attrs.frozen(eq=False)
class Points(GradedDiscretisation):
    """Given points, in the order in which they are given.

    They are either listed as `positions`, or read from a `file` with a row for each point and a
    column for each dimension: .npy, .csv with commas, or text with blanks; comments begin
    with #. It is a regular file of up to 4 GiB. A relative path begins in the
    folder of the scene file, in Python in the working folder. Where rows hold more, or in another
    order, `columns` names them: `["x", "y", "spacing", "volume"]`.

    If there are points on the surface and most are about a spacing apart, `volumes` that are not
    given integrate polynomials of the second degree, as those of `fitted-moments` do; otherwise
    that of a point is the part of the shape nearest to it, found by sampling and scaled to the
    exact total if the shape knows its volume. Each sample of the surface belongs to the nearest
    point. Tags are those of a lattice. There are no ghosts. A spacing that varies is to tell how
    far apart the points are: the support of each follows it. If the points have a column with the
    spacing of each, that of the body is `"given"`.

    Raises:
        SceneError: not exactly one of `positions` and `file` is given, one cannot be read, or
            `columns` are no columns.
    """

    positions: Array | None = attrs.field(default=None, converter=_as_array)  # (n, d) [m]
    file: str | Path | None = None
    volumes: Array | None = attrs.field(default=None, converter=_as_array)  # (n,) [m^d]
    columns: Sequence[str] | None = attrs.field(default=None, converter=_as_tuple)

    # Points in the rectangle of the conformance kit.
    example: ClassVar[Mapping[str, Any]] = {
        "positions": [[0.05 + 0.1 * i, 0.05 + 0.1 * j] for i in range(12) for j in range(8)]
    }

    def __attrs_post_init__(self) -> None:
        if (self.positions is None) == (self.file is None):
            given = "neither" if self.file is None else "both"
            raise refusal(self, f"give one of positions and file, got {given}")
        for name, value in (("positions", self.positions), ("volumes", self.volumes)):
            if value is not None and not isinstance(value, np.ndarray):
                raise refusal(self, f"{name} must be numbers in equal rows, got {short(value)}")
        if self.columns is not None:
            check_columns(self, self.columns)
            if VOLUME in self.columns and self.volumes is not None:
                raise refusal(self, "volumes are given twice, also as a column; drop one")

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The points as particles, with the given `spacing`.

        Raises:
            SceneError: the spacing is not positive, the file cannot be read, the points come with
                spacings, or a point is not finite, outside the shape, at the same place as another,
                or without a volume.
        """
        spacing, table = check_spacing(self, spacing), self._table(shape.dimension)
        if table.spacings is not None:
            raise refusal(
                self,
                f"the points come with spacings, and the body has the spacing {spacing:g} m; give "
                'it spacing = "given", or leave out the column',
            )
        self._check_places(shape, table.positions, spacing)
        X, surface = table.positions, sampled(self, shape, spacing)
        owned = faces(surface, _owners(shape, X, surface, lambda at: np.full(len(at), spacing)), X)
        if table.volumes is not None:
            return without_ghosts(X, self._checked(table.volumes, len(X)), spacing, owned)
        volumes = nearest_volumes(self, shape, X, spacing)
        made = without_ghosts(X, volumes, spacing, owned)
        # Fits over the spacing are no good where most points are much closer.
        apart = np.median(cKDTree(X).query(X, k=[2])[0]) if len(X) > 1 else 0.0
        if apart < _APART * spacing or not self.ends_on_surface(shape, spacing):
            return made
        size = float(np.ptp(X, axis=0).max())
        return lighter_on_surface(fitted(self, shape, spacing, made, size), shape)

    def graded_particles(self, shape: Shape, spacing: SpacingField) -> Particles:
        """The points as particles, with the spacing that the field has where they are.

        Raises:
            SceneError: as of `particles`, or the points come with other spacings.
        """
        table = self._table(shape.dimension)
        spacings = spacing.at(table.positions)
        if table.spacings is not None and not np.allclose(spacings, table.spacings):
            raise refusal(
                self,
                'the points come with other spacings than the body; give it spacing = "given", or '
                "leave out the column",
            )
        X = table.positions
        self._check_places(shape, X, spacing.least)
        surface = sampled(self, shape, spacing.least)
        owned = faces(surface, _owners(shape, X, surface, spacing.at), X)
        if table.volumes is not None:
            return without_ghosts(X, self._checked(table.volumes, len(X)), spacings, owned)
        return graded_fit(self, shape, spacing, without_ghosts(X, np.ones(len(X)), spacings, owned))

    def own_spacing(self, shape: Shape) -> SpacingField | None:
        """That of the column `spacing`, if there is one.

        Raises:
            SceneError: as of `particles`; a spacing is not positive, they are far from the
                distances of the points, or those of neighbours are too different.
        """
        if self.columns is None or SPACING not in self.columns:
            return None
        table = self._table(shape.dimension)
        assert table.spacings is not None
        return spacing_of_points(self, table.positions, table.spacings)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """True if most of the surface is nearest to points on it.

        Raises:
            SceneError: as of `particles`, where the file or the rows are wrong.
        """
        spacing = check_spacing(self, spacing)
        positions, surface = self._table(shape.dimension).positions, sampled(self, shape, spacing)
        depths = np.abs(shape.signed_distance(positions)) / spacing
        on = depths[cKDTree(positions).query(surface.points)[1]] <= _ON_SURFACE
        areas = np.linalg.norm(surface.area_vectors, axis=1)
        return bool(areas[on].sum() > 0.5 * areas.sum())

    def _table(self, dimension: int) -> PointTable:
        """The points, read anew."""
        given = self.positions if self.file is None else read_rows(self, Path(self.file))
        table = point_table(self, given, self.columns, dimension)
        return table if self.volumes is None else attrs.evolve(table, volumes=self.volumes)

    def _check_places(self, shape: Shape, positions: Array, spacing: float) -> None:
        distance = shape.signed_distance(positions)
        outside = distance > _TOLERANCE * spacing
        if outside.any():
            row = int(np.argmax(outside))
            raise refusal(
                self,
                f"point {row} at {positions[row].tolist()} m lies outside the shape, "
                f"{distance[row]:.3g} m from its surface ({outside.sum()} of {len(positions)} "
                "points do); move the points or the shape",
            )
        pairs = cKDTree(positions).query_pairs(_TOLERANCE * spacing, output_type="ndarray")
        if len(pairs):
            a, b = min(map(tuple, np.sort(pairs, axis=1).tolist()))
            raise refusal(
                self,
                f"points {a} and {b} are at the same place, {positions[a].tolist()} m; drop one",
            )

    def _checked(self, volumes: Array, count: int) -> Array:
        """The given `volumes` as a new array."""
        if volumes.shape != (count,):
            raise refusal(
                self,
                f"volumes must be one number for each of the {count} points, got an array of "
                f"shape {volumes.shape}",
            )
        bad = ~(np.isfinite(volumes) & (volumes > 0.0))
        if bad.any():
            row = int(np.argmax(bad))
            raise refusal(
                self,
                f"volumes must be positive and finite, got {volumes[row]} for point {row}",
            )
        return volumes.copy()


def nearest_volumes(
    discretisation: Discretisation, shape: Shape, points: Array, spacing: float
) -> Array:
    """Volume of the shape nearest to each of the `points` (n, d) [m], (n,) [m^d].

    Args:
        discretisation: the part that messages name.
        shape: the body.
        points: of the body.
        spacing: of the points [m].

    Raises:
        SceneError: a point has none.
    """
    tree, grid = cKDTree(points), grid_over(discretisation, shape, spacing)
    fine = _SAMPLES[shape.dimension]
    samples = attrs.evolve(
        grid,
        cells=tuple(fine * count for count in grid.cells),
        counts=tuple(fine * count for count in grid.counts),
    )
    hits = np.zeros(tree.n)
    for start in range(0, samples.size, _CHUNK):
        places = samples.positions(np.arange(start, min(start + _CHUNK, samples.size)))
        places = places[shape.signed_distance(places) <= 0.0]
        hits += nearest(tree, places).sums(np.ones(len(places)), tree.n)
    total = shape.volume()
    volumes: Array = hits * (samples.cell_volume if total is None else total / hits.sum())
    if not np.all(volumes > 0.0):
        point = int(np.argmin(volumes > 0.0))
        raise refusal(
            discretisation,
            f"point {point} is too close to others to be given a volume at a spacing of "
            f"{spacing:g} m; use a smaller spacing, or give volumes",
        )
    return volumes


def _owners(
    shape: Shape, positions: Array, surface: Surface, spacing_at: Callable[[Array], Array]
) -> Assignment:
    """The owner of each sample of the `surface`: the nearest point.

    If there are points on all of the surface, it is the nearest of those: where they are sparse, as
    in the middle of faces, one inside may be nearer, and would leave the areas unfitted.
    """
    depths = np.abs(shape.signed_distance(positions))
    at = np.flatnonzero(depths <= ON_BOUNDARY * spacing_at(positions))
    if len(at):
        outer = cKDTree(positions[at])
        if np.all(outer.query(surface.points)[0] <= spacing_at(surface.points)):
            found = nearest(outer, surface.points)
            return attrs.evolve(found, particles=at[found.particles])
    return nearest(cKDTree(positions), surface.points)
