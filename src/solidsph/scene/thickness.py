"""Where a body is thin, and how thin: from samples of its surface, whatever the shape.

The thickness at a place is the diameter of the largest ball inside the body that touches the
surface there, if it touches it opposite, too: where the surface faces the other way, up to an angle
of 30 degrees. So a corner is not thin, but a blade is, towards its edge.
"""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.scene.surface_levels import BEND, Level, first_level

# Cubes over the smallest thickness that is looked for, and the most cubes across.
_SIZE, _REACH = 1.0 / 3.0, 6.0


def thin_places(shape: Shape, least: float, greatest: float, finest: float) -> tuple[Array, Array]:
    """Places on a surface below which the body is thin, (m, d) [m], and its thickness, (m,) [m].

    Args:
        shape: whose thickness it is.
        least: smallest thickness that is looked for [m].
        greatest: largest thickness that is looked for [m].
        finest: least size of what is looked at [m].
    """
    level = first_level(shape, max(_SIZE * least, finest))
    points, found = [level.points], [_thicknesses(level)]
    while _REACH * level.size <= greatest:
        level = level.coarser(2.0 * level.size)[0]
        points.append(level.points)
        found.append(_thicknesses(level))
    every = np.concatenate(found)
    wanted = every <= greatest
    return np.concatenate(points)[wanted], every[wanted]


def _thicknesses(level: Level) -> Array:
    """The thickness below each place, up to the reach of a level, (m,) [m]; beyond it infinite."""
    ways = level.directions
    reach = _REACH * level.size
    thinnest = np.full(len(ways), np.inf)
    for a, b in level.near(reach):
        opposite = np.einsum("mi,mi->m", ways[a], ways[b]) < -BEND
        a, b = a[opposite], b[opposite]
        way = level.points[a] - level.points[b]
        depth = np.einsum("mi,mi->m", way, ways[a])
        below = depth > 0.0
        # The ball that touches the surface at one place, and goes through the other.
        ball = np.einsum("mi,mi->m", way[below], way[below]) / depth[below]
        np.minimum.at(thinnest, a[below], ball)
    thinnest[thinnest > reach] = np.inf
    return thinnest
