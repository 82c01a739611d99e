"""Sampling: what particles carry, at any points of the reference bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.interpolation import Sees, shape_functions
from solidsph.model.line_of_sight import line_ends, lines_leave
from solidsph.model.particles import Particles

# Distance by which a point may lie outside of a body [spacings]: coordinates on a curved surface
# are rounded.
_TOLERANCE = 1e-3


@attrs.frozen(eq=False)
class Sampling:
    """Values at m points, as weighted sums over the k particles on which they depend.

    A point depends on near particles of its own body that it sees, not on those across a gap.
    """

    points: Array  # (m, d) reference positions [m]
    particles: Indices  # (k,)
    functions: csr_array  # (m, k)
    slopes: Sequence[csr_array]  # d of (m, k) [1/m], or none

    @classmethod
    def of(
        cls,
        shapes: Mapping[str, Shape],
        particles: Particles,
        points: Array,
        bodies: Indices,
        *,
        slopes: bool = True,
    ) -> Sampling:
        """The sampling at `points` (m, d), each of a body, by its number in `shapes` (m,).

        Without `slopes` there are no gradients.
        """
        rows: list[Indices] = []
        columns: list[Indices] = []
        weights: list[Array] = []  # (1 + d, entries)
        for number, (name, shape) in enumerate(shapes.items()):
            chosen = np.flatnonzero(bodies == number)
            if not chosen.size:
                continue
            extent = particles.bodies[name]
            own = np.flatnonzero(~particles.ghosts[extent]) + extent.start
            X, spacing = particles.positions[own], particles.spacings[own]
            if not particles.graded:
                spacing = spacing.max()
            sees = None if shape.convex else _sees(shape, X, spacing)
            functions = shape_functions(X, spacing, points[chosen], sees, slopes=slopes)
            # The matrices have their entries in the same places.
            entries = functions.values.tocoo()
            rows.append(chosen[entries.row])
            columns.append(own[entries.col])
            weights.append(np.stack([functions.values.data, *(s.data for s in functions.slopes)]))
        used, place = np.unique(np.concatenate(columns), return_inverse=True)
        where = np.concatenate(rows), place
        matrices = [
            csr_array((data, where), shape=(len(points), used.size))
            for data in np.concatenate(weights, axis=1)
        ]
        return cls(points, used, matrices[0], matrices[1:])

    def interpolated(self, values: Array) -> Array:
        """Values of the particles (k, ...) at the points, (m, ...)."""
        flat = self.functions @ values.reshape(len(values), -1)
        return np.asarray(flat).reshape(len(self.points), *values.shape[1:])

    def gradients(self, vectors: Array) -> Array:
        """Gradients of vectors that the particles have (k, d), at the points, (m, d, d)."""
        return np.stack([slope @ vectors for slope in self.slopes], axis=2)


def located(
    shapes: Mapping[str, Shape],
    particles: Particles,
    points: ArrayLike,
    body: str | None = None,
) -> tuple[Array, Indices]:
    """Points as an array (m, d), and the number of the body that contains each, (m,).

    Args:
        shapes: of all bodies.
        particles: of all bodies.
        points: reference positions, (m, d) or (d,) [m].
        body: the body, where several touch; the one in which a point is deepest if None.

    Raises:
        SceneError: a point is not of the scene's dimension, or lies outside of every body.
    """
    X = _checked(points, particles.dimension)
    names = list(shapes)
    if body is not None and body not in names:
        raise SceneError(f"there is no body {body!r}; bodies: {', '.join(names)}")
    wanted = [number for number, name in enumerate(names) if body in (None, name)]
    distances = np.stack([shapes[names[number]].signed_distance(X) for number in wanted])
    spacings = [particles.spacings[particles.bodies[names[number]]].max() for number in wanted]
    nearest = distances.argmin(axis=0)
    least = distances[nearest, np.arange(len(X))]
    outside = np.flatnonzero(least > _TOLERANCE * np.array(spacings)[nearest])
    if outside.size:
        worst = outside[np.argmax(least[outside])]
        others = f", and {outside.size - 1} more points," if outside.size > 1 else ""
        whose = repr(names[wanted[nearest[worst]]]) if body is None else repr(body)
        what = "every body" if body is None and len(names) > 1 else f"body {whose}"
        raise SceneError(
            f"the point {[float(f'{x:.6g}') for x in X[worst]]}{others} lies outside of {what}, at "
            f"least {least[worst]:.3g} m from {whose}; give points of the undeformed body"
        )
    return X, np.array(wanted, dtype=np.intp)[nearest]


def _checked(points: Any, dimension: int) -> Array:
    """Points (m, d) from anything like an array."""
    try:
        X = np.atleast_2d(np.array(points, dtype=np.float64))
    except (TypeError, ValueError):
        X = np.empty((0, 0))
    if X.ndim != 2 or X.shape[1] != dimension or not len(X) or not np.all(np.isfinite(X)):
        raise SceneError(
            f"points must be reference positions (m, {dimension}) in metres, finite, got "
            f"{str(points)[:200]}"
        )
    return X


def _sees(shape: Shape, X: Array, spacing: Array | float) -> Sees:
    """Whether points see the particles at X (n, d), along lines inside the shape.

    `spacing` is that of each particle (n,), or one [m].
    """
    distance, spacings = shape.signed_distance, np.full(len(X), spacing)

    def sees(points: Array, near: Indices) -> Mask:
        m = len(points)
        chosen, place = np.unique(near, return_inverse=True)
        starts = line_ends(distance, points, spacings[near[:, 0]])
        ends = line_ends(distance, X[chosen], spacings[chosen])
        lines = np.stack([np.repeat(np.arange(m), near.shape[1]), m + place.ravel()])
        leave = lines_leave(
            distance,
            np.concatenate([starts[0], ends[0]]),
            np.concatenate([starts[1], ends[1]]),
            lines,
            float(spacings.min()),
        )
        return ~leave.reshape(near.shape)

    return sees
