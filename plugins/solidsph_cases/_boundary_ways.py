"""Ways to give a function's smoothed value or slope at the ends of a line, and their errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.terms import Constraint, StressTerm
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.boundaries.approximate_neumann import ApproximateNeumann
from solidsph_builtin.boundaries.exact_dirichlet import ExactDirichlet
from solidsph_builtin.boundaries.full_dirichlet import FullDirichlet
from solidsph_builtin.boundaries.ghost_extension import GhostExtension
from solidsph_builtin.boundaries.literal_dirichlet import LiteralDirichlet
from solidsph_cases._line import LENGTH, F, Line

NO_GHOSTS = "no ghosts"
ENDS_SOLVED = "no ghosts, eq. 11 with the interior"
CONSTANT = "ghosts at the boundary's value"
CONTINUED = "ghosts continue f"
PRINTED = "eq. 11 as printed"
FULL = "eq. 11 with the interior"
SMALLEST = "smallest change"

MIRRORED = "slopes mirrored"
SLOPE_SET = "slope set"

_Handler: TypeAlias = type[ExactDirichlet] | type[FullDirichlet] | type[LiteralDirichlet]


def ends(line: Line) -> Indices:
    """The two boundary particles."""
    result: Indices = np.flatnonzero(line.real)[[0, -1]]
    return result


def beside(line: Line) -> Mask:
    """Particles whose support leaves the range, but for those at its ends (n,)."""
    depth = np.minimum(line.X, LENGTH - line.X)
    near = line.real & (depth < line.kernel.support_radius)
    near[ends(line)] = False
    return near


def smoothed(line: Line, carried: Array) -> Array:
    """The approximation of what the particles carry (n,)."""
    return np.asarray(line.smoothing @ carried)


def largest_error(line: Line, approximation: Array, order: int = 0) -> float:
    """Of f or its slope at the particles beside the ends [m^4, m^3]."""
    return float(np.abs(approximation - F.deriv(order)(line.X))[beside(line)].max())


def miss(line: Line, approximation: Array) -> float:
    """How far <f> is above f at the left end [m^4]."""
    left = ends(line)[0]
    return float(approximation[left] - F(line.X[left]))


def block_size(line: Line) -> int:
    """Number of particles of a boundary and the ghosts beyond it."""
    return int(ends(line)[0]) + 1


def block_condition(line: Line) -> float:
    """Condition number of W's block of the left end and the ghosts beyond it [-]."""
    count = block_size(line)
    return float(np.linalg.cond(line.smoothing[:count, :count].toarray()))


def carried_values(line: Line) -> Mapping[str, Array]:
    """What every particle carries (n,), by the way that the ends are treated [m^4].

    A ghost that carries nothing is as good as none.
    """
    f = F(line.X)
    bare = np.where(line.real, f, 0.0)
    return {
        NO_GHOSTS: bare,
        ENDS_SOLVED: _ends_solved(line, bare),
        CONSTANT: F(np.clip(line.X, 0.0, LENGTH)),
        CONTINUED: f,
        PRINTED: _imposed(line, LiteralDirichlet),
        FULL: _imposed(line, FullDirichlet),
        SMALLEST: _imposed(line, ExactDirichlet),
    }


def _ends_solved(line: Line, values: Array) -> Array:
    """The ends' own values changed until the approximation is right; neither sees the other."""
    at = ends(line)
    missing = F(line.X[at]) - (line.smoothing @ values)[at]
    changed = values.copy()
    changed[at] += missing / line.smoothing.diagonal()[at]
    return changed


def _imposed(line: Line, kind: _Handler) -> Array:
    """By one of the handlers, which is told how f goes on beyond the ends."""
    field = {"x": lambda positions, time: F(positions[:, 0])}
    handler = kind(where="surface", displacement=field, extension=field)
    values = np.asarray(F(line.model.particles.positions), dtype=np.float64)
    for condition in handler.bind(line.model, "ends"):
        if isinstance(condition, Constraint):
            condition.impose(0.0, 0, values)
    result: Array = values[line.order, 0]
    return result


def carried_slopes(line: Line) -> Mapping[str, Array]:
    """The computed <f'> of every particle (n,), ghosts given by two handlers of stress [m^3].

    f itself goes on beyond the ends, so that <f'> is right up to them.
    """
    # Along the outward normal; f is symmetric, so that both ends have the same.
    asked = {"x": -float(F.deriv()(0.0))}
    return {
        MIRRORED: _stress_imposed(line, GhostExtension()),
        SLOPE_SET: _stress_imposed(line, ApproximateNeumann(where="surface", traction=asked)),
    }


def _stress_imposed(line: Line, handler: BoundaryHandler) -> Array:
    """<f'> taken for the stress of the line."""
    stress = np.zeros((1, 1, len(line.X)))
    stress[0, 0, line.order] = line.gradient @ F(line.X)
    for condition in handler.bind(line.model, "ends"):
        if isinstance(condition, StressTerm):
            condition.impose_stress(0.0, stress)
    result: Array = stress[0, 0, line.order]
    return result
