"""Particles on the surface under the gradient that a scheme takes for those inside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import BodyFacts, SceneFacts
from solidsph.scene.scene_data import RECOMMENDED

# Distance from the surface that counts as rounding [spacings].
_ON = 1e-6

# Share of the particles that own a part of the surface, from which they are meant to lie on it.
_MOST = 0.5


def surface_rows(facts: SceneFacts) -> Iterator[Advice]:
    """Find bodies with a discretisation of their own, in a scene that names no gradient.

    The recommended scheme takes 'corrected' for them, which suits particles half a spacing inside.
    On the surface it is too soft: a beam with 5 particles across bends 11 % too far, a confined
    block swings 2.4 % too slowly with 40 spacings along it, and one of graded points 28 %, where
    'consistent' is off by 0.05 % (the case `graded-points`).
    """
    scene, given = facts.simulation.scene, facts.simulation.scene.formulation
    is_named = given is not None and not (isinstance(given, Mapping) and "gradient" not in given)
    if facts.dimension == 1 or scene.scheme != RECOMMENDED or is_named or facts.fits_surface:
        return
    for body in facts.bodies:
        share = _share_on_surface(body)
        if share > _MOST:
            yield Advice(
                finding=f"{100.0 * share:.0f} % of the outer particles of body {body.name!r} lie "
                "on its surface, and the scheme takes the gradient 'corrected' for a "
                "discretisation that a scene names",
                expected="a gradient that takes the surface into account",
                remedy="gradient = 'consistent'; or particles half a spacing inside",
            )


def _share_on_surface(body: BodyFacts) -> float:
    particles = body.body.particles
    outer = np.flatnonzero(~particles.ghosts & particles.area_vectors.any(axis=1))
    if not outer.size:
        return 0.0
    depths = np.abs(body.body.shape.signed_distance(particles.positions[outer]))
    return float(np.mean(depths <= _ON * body.spacing))
