"""A body that passes through itself."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Need
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.watch.symptom import Finding, Grade, Symptom


@final
@attrs.frozen
class PassingThrough(Symptom):
    """A surface particle is among particles that were far from it, and no effect keeps them apart.

    Within a body nothing acts between particles that were no neighbours: the sides of a hole that
    closes, or the legs of a fold, go on through each other, with energies that add up.
    """

    steps_between: ClassVar[int] = 200  # it searches the neighbours of the surface

    near: float = 0.5  # distance at which two particles are in one place [spacings]
    far: float = 5.0  # distance at the start, and by the strain there now [spacings]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        answers = [effect.answers for effect in simulation.effects.values()]
        if any(one is None or Need.MEETING in one for one in answers):
            return None
        for body in simulation.model.bodies:
            extent = body.extent
            pair = self._pair(
                body,
                observation.state.positions[extent],
                observation.deformation_gradients[extent],
            )
            if pair is None:
                continue
            particle, distance = pair
            return Finding(
                Grade.WARNING,
                body.extent.start + particle,
                f"body {body.name!r} passes through itself: here are two particles that were "
                f"{distance:.3g} m apart",
                f"the effect 'contact' with itself = [{body.name!r}]",
            )
        return None

    def _pair(self, body: Body, positions: Array, F: Array) -> tuple[int, float] | None:
        """A surface particle in the place of another, and their distance at the start [m].

        By its own strain the other would be far from it: so it is none that was pressed to it.
        """
        particles = body.particles
        surface = np.flatnonzero(particles.area_vectors.any(axis=1) & ~particles.ghosts)
        spacing = float(particles.spacings.min())
        if not surface.size or not np.isfinite(positions).all():
            return None
        tree = cKDTree(positions)
        found = tree.query_ball_point(positions[surface], self.near * spacing)
        for p, others in zip(surface, found, strict=True):
            lines = particles.positions[others] - particles.positions[p]
            away = np.linalg.norm(lines, axis=1)
            least = np.minimum(away, np.linalg.norm(lines @ F[p].T, axis=1))
            if least.max() > self.far * spacing:
                return int(p), float(away[np.argmax(least)])
        return None
