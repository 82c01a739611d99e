"""Neighbours that collapse onto each other."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.watch.symptom import Finding, Symptom

# Distance of nearest neighbours in spacings; they are the first to meet.
_NEAR = 1.2


@final
@attrs.frozen
class CollapsingNeighbours(Symptom):
    """Two nearest neighbours are at a small part of their reference distance."""

    warning: float = 0.15  # [-]; metal that flows comes to 0.2
    failure: float = 0.03  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        particle, least, closest = 0, np.inf, simulation.model.bodies[0]
        for body in simulation.model.bodies:
            a, b, inverse_squares = _nearest(body)
            if not len(a):
                continue
            with np.errstate(all="ignore"):
                squares = _squares(observation.state.positions[body.extent], a, b)
                squares *= inverse_squares
            pair = int(np.argmin(squares))  # the first NaN, if there is one
            ratio = float(np.sqrt(squares[pair]))
            if not ratio >= least:
                particle, least, closest = body.extent.start + int(a[pair]), ratio, body
        if closest.formulation.configuration is Configuration.CURRENT:
            remedy = "the total Lagrangian form, in which tension does not pull particles together"
        else:
            remedy = "hourglass-control, against motions that the gradient does not see"
        return Finding.graded(
            1.0 / least if least > 0.0 else np.inf,
            1.0 / self.warning,
            1.0 / self.failure,
            particle=particle,
            cause=f"a neighbour has come to {least:.3g} of its reference distance",
            remedy=f"{remedy}; a smaller step; artificial-viscosity where something strikes",
        )


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
    """Pairs of nearest neighbours, each once, and 1 / distance^2 of each [m^-2]; kept in `body`."""
    if CollapsingNeighbours not in body.made:
        particles = body.particles
        pairs = cKDTree(particles.positions).query_pairs(
            _NEAR * float(particles.spacings.max()), output_type="ndarray"
        )
        pairs = pairs[~particles.ghosts[pairs].any(axis=1)]
        if body.hidden is not None:
            pairs = pairs[~body.hidden.between(pairs[:, 0], pairs[:, 1])]
        a, b = np.ascontiguousarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T)
        body.made[CollapsingNeighbours] = (a, b, 1.0 / _squares(particles.positions, a, b))
    nearest: tuple[Indices, Indices, Array] = body.made[CollapsingNeighbours]
    return nearest
