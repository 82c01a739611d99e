"""Particles of a body that may touch, and how much room the other body has around them."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.interpolate import RegularGridInterpolator

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
    """The same of a body whose spacing varies: rows are as far apart as it says there."""

    _table: RegularGridInterpolator

    @classmethod
    def of(cls, body: Body) -> FilledBeside:
        kernel = crowding_kernel(body.particles.dimension, 1.0)
        heights = np.linspace(0.0, 1.0, _TABULATED)
        across = layer(kernel, heights)
        filled = np.zeros((len(_RATIOS), _TABULATED))
        for depth, thickness in _graded_rows(body, REACH / float(_RATIOS[0])):
            for k, width in enumerate(_RATIOS / REACH):
                below = heights + depth * width
                filled[k] += thickness * width * np.interp(below, heights, across, right=0.0)
        return cls(RegularGridInterpolator((_RATIOS, heights), filled))

    def at(self, heights: Array, spacings: Array, reaches: Array) -> Array:
        """Volume fraction at `heights` above a plane face with these `spacings` of the body,
        smoothed over these `reaches`, all (k,) [m]: (k,) [-]."""
        ratios = np.clip(REACH * spacings / reaches, _RATIOS[0], 1.0)
        found = self._table(np.stack([ratios, np.minimum(heights / reaches, 1.0)], axis=1))
        return np.asarray(found)


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


def _graded_rows(body: Body, reach: float) -> list[tuple[float, float]]:
    """The same where rows are soon lost. The first is as thick as volumes are for their areas, and
    the second makes good for that."""
    own = body.particles
    below, owners = _below(body)
    first = _first(below, owners)
    thickness = first + 0.5
    if owners.any():
        areas = np.linalg.norm(own.area_vectors[owners], axis=1)
        thickness = float(np.median(own.volumes[owners] / areas / own.spacings[owners]))
    depths = np.arange(first, reach, 1.0)
    thick = np.ones(len(depths))
    thick[0], thick[1] = thickness, first + 1.5 - thickness
    return list(zip(depths.tolist(), thick.tolist(), strict=True))


def _below(body: Body) -> tuple[Array, Mask]:
    """Depths of all particles (n,) [spacings], and which ones own the surface, (n,)."""
    own = body.particles
    below = -body.shape.signed_distance(own.positions) / own.spacings
    return below, np.any(own.area_vectors != 0.0, axis=1) & ~own.ghosts


def _first(below: Array, owners: Mask) -> float:
    """Depth of the first row [spacings], the median of those that own the surface: half a spacing
    for centres of cells, and 0 on the surface."""
    return min(max(float(np.median(below[owners])), 0.0), 1.0) if owners.any() else 0.5
