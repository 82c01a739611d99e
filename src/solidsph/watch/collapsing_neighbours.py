"""Neighbours that collapse onto each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.run.accounts import Accounts
from solidsph.watch.symptom import Finding, Symptom, graded

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene

# Nearest neighbours alone, in spacings: they are the first to meet.
_NEAR = 1.2


@final
@attrs.frozen
class CollapsingNeighbours(Symptom):
    """Two nearest neighbours are at a small part of their first distance."""

    warning: float = 0.15  # [-]; metal that flows comes to 0.2
    failure: float = 0.03  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        found, part = 0, np.inf
        for body in simulation.model.bodies:
            a, b, first = _nearest(body)
            if not len(a):
                continue
            with np.errstate(all="ignore"):
                squares = _squares(observation.state.positions[body.extent], a, b)
                squares *= first
            closest = int(np.argmin(squares))  # the first that is no number, if there is one
            ratio = float(np.sqrt(squares[closest]))
            if not ratio >= part:
                found, part = body.extent.start + int(a[closest]), ratio
        grade = graded(1.0 / part if part > 0.0 else np.inf, 1.0 / self.warning, 1.0 / self.failure)
        if grade is None:
            return None
        return Finding(
            grade,
            found,
            f"a neighbour has come to {part:.3g} of its first distance",
            f"{_help(simulation, found)}; a smaller step; artificial-viscosity where something "
            "strikes",
        )


def _help(simulation: BuiltScene, particle: int) -> str:
    """Against what brings particles of this body together."""
    bodies = simulation.model.bodies
    body = next(one for one in bodies if one.extent.start <= particle < one.extent.stop)
    if body.formulation.configuration is Configuration.CURRENT:
        return (
            "the total Lagrangian form, in which particles under tension do not attract each other"
        )
    return "hourglass-control, against motions that the gradient does not see"


def _squares(positions: Array, a: Indices, b: Indices) -> Array:
    # Axis by axis: rows of two or three numbers are slow to gather and to sum.
    total = np.zeros(len(a))
    for axis in range(positions.shape[1]):
        along = np.ascontiguousarray(positions[:, axis])
        apart = along.take(b)
        apart -= along.take(a)
        apart *= apart
        total += apart
    return total


def _nearest(body: Body) -> tuple[Indices, Indices, Array]:
    """Pairs of nearest neighbours, each once, and one over the square of their distance [m^-2].

    Found when they are asked for first.
    """
    if CollapsingNeighbours not in body.made:
        particles = body.particles
        pairs = cKDTree(particles.positions).query_pairs(
            _NEAR * float(particles.spacings.max()), output_type="ndarray"
        )
        pairs = pairs[~particles.ghosts[pairs].any(axis=1)]
        if body.hidden is not None:
            pairs = pairs[~body.hidden.between(pairs[:, 0], pairs[:, 1])]
        a, b = (
            np.ascontiguousarray(one) for one in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
        )
        body.made[CollapsingNeighbours] = (a, b, 1.0 / _squares(particles.positions, a, b))
    found: tuple[Indices, Indices, Array] = body.made[CollapsingNeighbours]
    return found
