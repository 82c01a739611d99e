"""SpacingField: a spacing of particles that varies from place to place."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask

STEEPEST = 0.5
"""Largest growth of a spacing over a distance [-]: less than twofold over a cubic spline's support.
A particle's neighbours are then about as far apart as the particle itself is from them."""

MOST_RATIO = 100.0
"""Largest ratio of spacings in one body: its boundary is sampled for the least everywhere."""

# A cell no larger than the spacing at its centre holds none below two thirds of that, as long as
# the spacing grows no faster than `STEEPEST`.
_FINEST_PART = 1.0

# Cells across the box to begin with: a spacing is read in each.
_FIRST = 8.0

# Levels by which a cell may be halved: a spacing of a millionth of the body.
_MOST_LEVELS = 20


@final
@attrs.frozen(eq=False)
class SpacingField:
    """A spacing at every place, and the range that it keeps to within a body."""

    wanted: Callable[[Array], Array]  # at X (n, d), (n,) [m]
    least: float  # [m]
    greatest: float  # [m]

    def at(self, X: Array) -> Array:
        """The spacing at X (n, d) [m], (n,) [m].

        Outside of the body, where a formula may have no value, it is at least half the least and
        at most twice the greatest.
        """
        s = self.wanted(X)
        known = np.where(np.isfinite(s), s, self.greatest)
        return np.clip(known, 0.5 * self.least, 2.0 * self.greatest)


@attrs.frozen(eq=False)
class Cells:
    """Cubes that fill a box, each about as large as the spacing there."""

    centres: Array  # (m, d) [m]
    sizes: Array  # (m,) of their edges [m]

    @property
    def volumes(self) -> Array:
        """(m,) [m^d]."""
        return np.asarray(self.sizes ** self.centres.shape[1])


def cells_over(
    lower: Array,
    upper: Array,
    spacing: Callable[[Array], Array],
    reaches: Callable[[Array, Array], Mask],
    part: float = _FINEST_PART,
    most: float = np.inf,
) -> Cells:
    """Cubes over a box, halved until each is no larger than a part of the spacing at its centre.

    Args:
        lower: corner of the box, (d,) [m].
        upper: the other one.
        spacing: at places (n, d) [m], (n,) [m].
        reaches: whether cubes about places (n, d) with half diagonals (n,) [m] are wanted, (n,).
        part: of the spacing [-].
        most: if more cubes than this are to be expected, none is halved any more, and some of those
            returned are too large.
    """
    lengths = upper - lower
    edge = float(lengths.min()) / _FIRST
    counts = np.maximum(1, np.ceil(lengths / edge * (1.0 - 1e-9)).astype(np.intp))
    d = len(counts)
    index = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, d)
    centres = 0.5 * (lower + upper) + (index + 0.5 - 0.5 * counts) * edge
    corners = np.array(list(product((-0.25, 0.25), repeat=d)))
    settled: list[tuple[Array, Array]] = []
    done = 0
    for _ in range(_MOST_LEVELS):
        wanted = reaches(centres, np.full(len(centres), 0.5 * np.sqrt(d) * edge))
        centres = centres[wanted]
        wanted_size = part * spacing(centres)
        large = edge > wanted_size
        with np.errstate(over="ignore", divide="ignore"):
            coming = float(np.sum((edge / wanted_size[large]) ** d))
        kept = centres if done + coming > most else centres[~large]
        settled.append((kept, np.full(len(kept), edge)))
        done += len(kept)
        if len(kept) == len(centres):
            break
        centres = (centres[large][:, None, :] + corners * edge).reshape(-1, d)
        edge *= 0.5
    places, sizes = (np.concatenate(parts) for parts in zip(*settled, strict=True))
    return Cells(places, sizes)


def smooth_step(t: Array) -> Array:
    """From 0 at t <= 0 to 1 at t >= 1 with two continuous derivatives, and a slope below 1.875."""
    t = np.clip(t, 0.0, 1.0)
    result: Array = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    return result


STEEPEST_STEP = 1.875
"""Largest slope of `smooth_step`."""
