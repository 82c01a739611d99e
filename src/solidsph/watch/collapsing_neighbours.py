"""Neighbours that collapse onto each other."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.watch.symptom import Finding, Symptom


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
            a, b = body.nearest_pairs
            if not len(a):
                continue
            with np.errstate(all="ignore"):
                squares = _squares(observation.state.positions[body.extent], a, b)
                squares /= _squares(body.particles.positions, a, b)
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
