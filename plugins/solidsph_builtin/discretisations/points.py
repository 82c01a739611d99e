"""Points: particles wherever the user wants them."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from reprlib import repr as short
from typing import Any, ClassVar

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField
from solidsph.system.encoding import decoded
from solidsph.system.files import content, located
from solidsph_builtin.discretisations._checks import check_spacing, refusal
from solidsph_builtin.discretisations._graded_fitting import graded_fit
from solidsph_builtin.discretisations._grid import Grid, grid_over
from solidsph_builtin.discretisations._nearest import nearest
from solidsph_builtin.discretisations._surface import faces, sampled, without_ghosts

# Closer than this, in spacings, two points coincide; a point outside by less than this is inside.
_TOLERANCE = 1e-6
# A point is on the surface up to this depth, in spacings: nodes of a mesh stand on its facets, and
# files hold few digits. Up to here 'consistent' errs less than 'corrected' in bending and torsion.
_ON_SURFACE = 0.1
# Samples along a spacing from which the volumes nearest to points are found, for each dimension.
# Even, so that none lies half way between two points of a lattice.
_SAMPLES = {1: 64, 2: 8, 3: 4}
_CHUNK = 1 << 16
# Size of a file of points: some 25 characters for each coordinate of 5e7 points in space.
_MOST_BYTES = 2**32


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


@attrs.frozen(eq=False)
class Points(GradedDiscretisation):
    """Given points, in the order in which they are given.

    They are either listed as `positions`, or read from a `file` with a row for each point and a
    column for each dimension: .npy, .csv with commas, or text with blanks; comments begin
    with #. It is a regular file of up to 4 GiB. A relative path begins in the
    folder of the scene file, in Python in the working folder.

    Without given `volumes` that of a point is the part of the shape nearest to it, found by
    sampling and scaled to the exact total if the shape knows its volume. Each sample of the surface
    belongs to the nearest point. Tags are those of a lattice. There are no ghosts. A spacing that
    varies is to tell how far apart the points are: the support of each follows it, and volumes
    that are not given integrate polynomials, as those of `fitted-moments` do.

    Raises:
        SceneError: not exactly one of `positions` and `file` is given, or one cannot be read.
    """

    positions: Array | None = attrs.field(default=None, converter=_as_array)  # (n, d) [m]
    file: str | Path | None = None
    volumes: Array | None = attrs.field(default=None, converter=_as_array)  # (n,) [m^d]

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

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The points as particles, with the given `spacing`.

        Raises:
            SceneError: the spacing is not positive, the file cannot be read, or a point is not
                finite, outside the shape, at the same place as another, or without a volume.
        """
        spacing = check_spacing(self, spacing)
        return self._made(shape, spacing, lambda tree: self._nearest_volumes(shape, tree, spacing))

    def graded_particles(self, shape: Shape, spacing: SpacingField) -> Particles:
        """The points as particles, with the spacing that the field has where they are.

        Raises:
            SceneError: as of `particles`.
        """
        made = self._made(shape, spacing.least, lambda tree: np.ones(tree.n))
        made = attrs.evolve(made, spacings=spacing.at(made.positions))
        return made if self.volumes is not None else graded_fit(self, shape, spacing, made)

    def _made(self, shape: Shape, spacing: float, volumes: Callable[[cKDTree], Array]) -> Particles:
        """The points as particles with one spacing, and `volumes` (n,) where none are given."""
        positions = self._positions(shape.dimension)
        self._check_places(shape, positions, spacing)
        tree = cKDTree(positions)
        surface = sampled(self, shape, spacing)
        owned = faces(surface, nearest(tree, surface.points), positions)
        own = volumes(tree) if self.volumes is None else self._given_volumes(tree)
        if not np.all(own > 0.0):
            point = int(np.argmin(own > 0.0))
            raise refusal(
                self,
                f"point {point} is too close to others to be given a volume at a spacing of "
                f"{spacing:g} m; use a smaller spacing, or give volumes",
            )
        return without_ghosts(positions, own, spacing, owned)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """True if most of the surface is nearest to points on it.

        Raises:
            SceneError: as of `particles`, where the file or the rows are wrong.
        """
        spacing = check_spacing(self, spacing)
        positions, surface = self._positions(shape.dimension), sampled(self, shape, spacing)
        depths = np.abs(shape.signed_distance(positions)) / spacing
        on = depths[cKDTree(positions).query(surface.points)[1]] <= _ON_SURFACE
        areas = np.linalg.norm(surface.area_vectors, axis=1)
        return bool(areas[on].sum() > 0.5 * areas.sum())

    def _positions(self, dimension: int) -> Array:
        """The points as a new array (n, d) [m]."""
        given = self._read(Path(self.file)) if self.file is not None else self.positions
        points = np.array(given, dtype=np.float64, order="C")
        if points.ndim == 1 and dimension == 1:
            points = points[:, np.newaxis]
        if points.ndim != 2 or points.shape[1] != dimension or not len(points):
            raise refusal(
                self,
                f"the positions must be rows of {dimension} coordinates, as the shape has "
                f"dimensions, got an array of shape {points.shape}",
            )
        bad = ~np.isfinite(points).all(axis=1)
        if bad.any():
            row = int(np.argmax(bad))
            raise refusal(self, f"row {row} of the positions is not finite: {points[row].tolist()}")
        return points

    def _read(self, path: Path) -> Array:
        try:
            with warnings.catch_warnings():
                # For a file without any number NumPy only warns.
                warnings.simplefilter("error", UserWarning)
                data, suffix = content(located(path), _MOST_BYTES), path.suffix.lower()
                if suffix == ".npy":
                    loaded = np.load(io.BytesIO(data), allow_pickle=False)
                    return np.asarray(loaded, dtype=np.float64)
                return _table(decoded(data), "," if suffix == ".csv" else None)
        except (OSError, ValueError, TypeError, EOFError, UserWarning, MemoryError) as error:
            raise refusal(
                self, f"cannot read positions from {str(path)!r}: {error}; expected rows of numbers"
            ) from error

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

    def _given_volumes(self, tree: cKDTree) -> Array:
        assert self.volumes is not None
        if self.volumes.shape != (tree.n,):
            raise refusal(
                self,
                f"volumes must be one number for each of the {tree.n} points, got an array of "
                f"shape {self.volumes.shape}",
            )
        bad = ~(np.isfinite(self.volumes) & (self.volumes > 0.0))
        if bad.any():
            row = int(np.argmax(bad))
            raise refusal(
                self,
                f"volumes must be positive and finite, got {self.volumes[row]} for point {row}",
            )
        return self.volumes.copy()

    def _nearest_volumes(self, shape: Shape, tree: cKDTree, spacing: float) -> Array:
        """Volume of the shape nearest to each point, (n,) [m^d]."""
        grid: Grid = grid_over(self, shape, spacing)
        fine = _SAMPLES[shape.dimension]
        samples = attrs.evolve(
            grid,
            cells=tuple(fine * count for count in grid.cells),
            counts=tuple(fine * count for count in grid.counts),
        )
        hits = np.zeros(tree.n)
        for start in range(0, samples.size, _CHUNK):
            points = samples.positions(np.arange(start, min(start + _CHUNK, samples.size)))
            points = points[shape.signed_distance(points) <= 0.0]
            hits += nearest(tree, points).sums(np.ones(len(points)), tree.n)
        total = shape.volume()
        volumes: Array = hits * (samples.cell_volume if total is None else total / hits.sum())
        return volumes


def _table(text: str, delimiter: str | None) -> Array:
    """Rows of numbers.

    Raises:
        ValueError: a row holds something else.
    """
    try:
        return np.loadtxt(io.StringIO(text), delimiter=delimiter, ndmin=2)
    except ValueError as cause:
        lines = (line.partition("#")[0].strip() for line in text.splitlines())
        first = next(filter(None, lines), "")
        if any(_is_number(word) for word in first.split(delimiter)):
            raise
        hint = f"its first line {short(first)} is not a row of numbers; begin a header with '#'"
        raise ValueError(f"{cause}: {hint}") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
