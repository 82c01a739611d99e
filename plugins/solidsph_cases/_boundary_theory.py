"""What the ways to treat a boundary must give: closed forms there, dense algebra beside it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from solidsph.maths.arrays import Array, Indices
from solidsph_cases import _boundary_ways as ways
from solidsph_cases._line import LENGTH, F, Line
from solidsph_cases._moments import of_lattice


def values_at_left_end(line: Line) -> Mapping[str, float]:
    """<f> at x = 0 by moments of the kernel on a lattice, by way [m^4]."""
    moments = of_lattice(line.kernel, line.spacing)
    asked = float(F(0.0))
    own = _own_weight(line) * asked
    # The boundary particle, whole, and the interior; one side of a lattice has half of the former.
    inner = float(moments.smoothed_at_left_end(F)(0.0)) - 0.5 * own
    others = 0.5 * (moments.value[0] - _own_weight(line))
    return {
        ways.NO_GHOSTS: inner + own,
        ways.ENDS_SOLVED: asked,
        ways.CONSTANT: inner + own + others * asked,
        ways.CONTINUED: float(moments.smoothed(F)(0.0)),
        # W_BG,BG f_new is what was asked, and the interior comes to it.
        ways.PRINTED: asked + inner,
        ways.FULL: asked,
        ways.SMALLEST: asked,
    }


def slopes_at_left_end(line: Line) -> Mapping[str, float]:
    """<<f'>> at x = 0, by way [m^3]."""
    moments = of_lattice(line.kernel, line.spacing)
    mirrored = 2.0 * moments.smoothed_at_left_end(moments.differentiated(F))(0.0)
    return {ways.MIRRORED: float(mirrored), ways.SLOPE_SET: float(F.deriv()(0.0))}


def smoothed_values(line: Line) -> Mapping[str, Array]:
    """<f> at every particle (n,) by way, from sums written out and dense solves [m^4]."""
    W = _dense(line)
    f = F(line.X)
    bare = np.where(line.real, f, 0.0)
    at = ways.ends(line)
    free = np.union1d(at, np.flatnonzero(~line.real))  # boundary and ghosts
    inside = np.where(np.isin(np.arange(len(f)), free), 0.0, f)
    square = W[np.ix_(free, free)]

    no_ends = _with(bare, at, 0.0)
    alone = np.linalg.solve(W[np.ix_(at, at)], (f - W @ no_ends)[at])
    # Of all solutions the least squares of few equations have the smallest norm.
    change = np.linalg.lstsq(W[np.ix_(at, free)], (f - W @ f)[at])[0]
    carried = {
        ways.NO_GHOSTS: bare,
        ways.ENDS_SOLVED: _with(bare, at, alone),
        ways.CONSTANT: F(np.clip(line.X, 0.0, LENGTH)),
        ways.CONTINUED: f,
        ways.PRINTED: _with(f, free, np.linalg.solve(square, f[free])),
        ways.FULL: _with(f, free, np.linalg.solve(square, (f - W @ inside)[free])),
        ways.SMALLEST: _with(f, free, f[free] + change),
    }
    return {way: W @ own for way, own in carried.items()}


def smoothed_slopes(line: Line) -> Mapping[str, Array]:
    """<<f'>> at every particle (n,) by way, by the same means [m^3]."""
    W = _dense(line)
    first = of_lattice(line.kernel, line.spacing).differentiated(F)
    # Mirrored at both ends: even about x = 0, and about x = 1.
    mirrored = first(LENGTH - np.abs(LENGTH - np.abs(line.X)))
    at = ways.ends(line)
    free = np.union1d(at, np.flatnonzero(~line.real))
    missing = F.deriv()(line.X[at]) - (W @ mirrored)[at]
    changed = mirrored.copy()
    changed[free] += np.linalg.lstsq(W[np.ix_(at, free)], missing)[0]
    return {ways.MIRRORED: W @ mirrored, ways.SLOPE_SET: W @ changed}


def _with(values: Array, at: Indices, changed: ArrayLike) -> Array:
    """Those values, others at some places."""
    result = values.copy()
    result[at] = changed
    return result


def condition(line: Line, count: int) -> float:
    """Of W's block of the first so many particles, symmetric, by its eigenvalues [-]."""
    sizes = np.abs(np.linalg.eigvalsh(_dense(line)[:count, :count]))
    return float(sizes.max() / sizes.min())


def least_of_gradient(line: Line, first: int, last: int) -> float:
    """Smallest over largest singular value of the gradient's block of particles [first, last) [-].

    It is antisymmetric: of odd order its determinant is its own negative, and zero.
    """
    if (last - first) % 2:
        return 0.0
    x = line.X[first:last]
    offsets = x[:, None] - x
    block = line.spacing * np.sign(offsets) * line.kernel.slope(np.abs(offsets))
    # Times the imaginary unit it is Hermitian.
    sizes = np.abs(np.linalg.eigvalsh(1j * block))
    return float(sizes.min() / sizes.max())


def _dense(line: Line) -> Array:
    """W (n, n) from the kernel, every particle with a whole cell."""
    W: Array = line.spacing * line.kernel.value(np.abs(line.X[:, None] - line.X))
    return W


def _own_weight(line: Line) -> float:
    """What a particle counts in its own approximation [-]."""
    return line.spacing * float(line.kernel.value(np.zeros(1))[0])
