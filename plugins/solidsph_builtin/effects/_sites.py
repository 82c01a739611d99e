"""Particles of a body that may touch, and how much room the other body has around them."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.effects._crowding import REACH, crowding_kernel, layer

# Number of depths at which the volume fraction beside a plane face is tabulated; interpolation is
# then right to 1e-6.
_TABULATED = 1000

# Ratios of two spacings at which it is tabulated. It changes with their square, by some hundredths:
# interpolation is right to 1e-5.
_RATIOS = np.linspace(0.02, 1.0, 50)

# Owners of the surface that are beside a particle, by dimension: as far as some spacings.
_BESIDE = {1: 1, 2: 7, 3: 25}

# Particles this close to the depth of a row belong to it, in spacings.
_ROW = 0.3


@attrs.frozen(eq=False)
class Sites:
    """Particles of a body that may touch another body."""

    particles: Indices  # (m,) among those of all bodies
    positions: Array  # (m, d) X [m]
    volumes: Array  # (m,) V [m^d]
    spacings: Array  # (m,) s [m]
    depths: Array  # (m,) below the surface of the body [m]


def sites(body: Body, *, within: float = np.inf) -> Sites:
    """The particles of a body, or only those less than `within` [m] below its surface."""
    own = body.particles
    real = np.flatnonzero(~own.ghosts)
    depths = np.maximum(0.0, -body.shape.signed_distance(own.positions[real]))
    near = depths < within
    real, depths = real[near], depths[near]
    return Sites(
        particles=real + body.extent.start,
        positions=own.positions[real],
        volumes=own.volumes[real],
        spacings=own.spacings[real],
        depths=depths,
    )


def filled_beside(body: Body, kernel: SmoothingKernel, heights: Array) -> Array:
    """Volume fraction of a body of one spacing at `heights` (m,) above a plane face, (m,) [-].

    It depends on the rows of particles of the body, because a sum over rows is not the integral.
    """
    table = np.linspace(0.0, kernel.support_radius, _TABULATED)
    filled = np.zeros(_TABULATED)
    spacing = float(np.median(body.particles.spacings[~body.particles.ghosts]))
    for depth, thickness in _rows(body, kernel.support_radius / spacing):
        filled += thickness * spacing * layer(kernel, table + depth * spacing)
    return np.interp(heights, table, filled)


@attrs.frozen(eq=False)
class FilledBeside:
    """The same of a body whose spacing varies, by the spacing and the thickness of its first row.

    Rows that are further in are soon lost: they count as a spacing thick, and the second one makes
    good for the first.
    """

    _usual: RegularGridInterpolator  # by ratio of spacings and height, of a first row as usual
    _change: RegularGridInterpolator  # of a first row that is a spacing thicker
    thickness: float  # of the first row, as usual [spacings]

    @classmethod
    def of(cls, body: Body) -> FilledBeside:
        kernel = crowding_kernel(body.particles.dimension, 1.0)
        heights = np.linspace(0.0, 1.0, _TABULATED)
        across = layer(kernel, heights)
        first = _first(*_below(body))
        widths = _RATIOS[:, None] / REACH  # of a spacing, in reaches

        def row(depth: float) -> Array:
            below = heights + depth * widths
            return np.asarray(widths * np.interp(below, heights, across, right=0.0))

        rows = [row(depth) for depth in np.arange(first, REACH / float(_RATIOS[0]), 1.0)]
        usual = (first + 0.5) * rows[0] + sum(rows[1:])
        grid = _RATIOS, heights
        return cls(
            RegularGridInterpolator(grid, usual),
            RegularGridInterpolator(grid, rows[0] - rows[1]),
            first + 0.5,
        )

    def at(self, heights: Array, spacings: Array, thicknesses: Array, reaches: Array) -> Array:
        """Volume fraction at `heights` above a plane face [m], (k,) [-].

        Args:
            heights: (k,) [m].
            spacings: of the body there, (k,) [m].
            thicknesses: of its first row there, (k,) [spacings].
            reaches: over which it is smoothed, (k,) [m].
        """
        ratios = np.clip(REACH * spacings / reaches, _RATIOS[0], 1.0)
        places = np.stack([ratios, np.minimum(heights / reaches, 1.0)], axis=1)
        change = (thicknesses - self.thickness) * self._change(places)
        return np.asarray(self._usual(places) + change)


def first_row(body: Body) -> Array:
    """Thickness of the first row of particles below the surface, beside each particle (n,)
    [spacings]: that of the volumes of those who own the surface, over their areas.

    It is the median of some, among which those at an edge, with two areas, do not count.
    """
    own = body.particles
    below, owners = _below(body)
    if not owners.any():
        return np.full(own.count, _first(below, owners) + 0.5)
    areas = np.linalg.norm(own.area_vectors[owners], axis=1)
    thick = own.volumes[owners] / areas / own.spacings[owners]
    count = min(_BESIDE[own.dimension], len(thick))
    _, near = cKDTree(own.positions[owners]).query(own.positions, count)
    return np.asarray(np.median(thick[near.reshape(own.count, count)], axis=1))


def _rows(body: Body, reach: float) -> list[tuple[float, float]]:
    """Depth and thickness of the rows of particles below a plane face, down to `reach`; all in
    spacings.

    A row is as thick as its particles' volumes say, which for particles on the surface are a half
    of the others, or what a fit of volumes gives them.
    """
    own = body.particles
    below, owners = _below(body)
    first = _first(below, owners)
    thick = own.volumes / own.spacings**own.dimension
    rows = []
    for k, z in enumerate(np.arange(first, reach, 1.0)):
        there = thick[(np.abs(below - z) < _ROW) & ~own.ghosts]
        usual = 1.0 if k else first + 0.5
        rows.append((float(z), float(np.median(there)) if there.size else usual))
    return rows


def _below(body: Body) -> tuple[Array, Mask]:
    """Depths of all particles (n,) [spacings], and which ones own the surface, (n,)."""
    own = body.particles
    below = -body.shape.signed_distance(own.positions) / own.spacings
    return below, np.any(own.area_vectors != 0.0, axis=1) & ~own.ghosts


def _first(below: Array, owners: Mask) -> float:
    """Depth of the first row [spacings], the median of those that own the surface: half a spacing
    for centres of cells, and 0 on the surface."""
    return min(max(float(np.median(below[owners])), 0.0), 1.0) if owners.any() else 0.5
