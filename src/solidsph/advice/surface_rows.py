"""Particles on the surface, where a scheme takes the gradient for those inside."""

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
    """Find bodies on whose surface particles lie, in a scene that gets 'corrected' all the same.

    One gradient serves all bodies, and effects that need particles at the centres of cells get
    'corrected', which suits particles half a spacing inside. On the surface it is too soft: a beam
    with 5 particles across bends 39 % too far, and a block of graded points swings 28 % too slowly.
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
                "on its surface, and the scheme takes the gradient 'corrected', as another body's "
                "lie inside or an effect asks for particles at the centres of cells",
                expected="particles of all bodies on the surface, or of none",
                remedy="the same discretisation for every body: none named, or 'lattice', which is "
                "at the centres of cells; or name a gradient",
            )


def _share_on_surface(body: BodyFacts) -> float:
    particles = body.body.particles
    outer = np.flatnonzero(~particles.ghosts & particles.area_vectors.any(axis=1))
    if not outer.size or particles.ghosts.any():
        return 0.0
    depths = np.abs(body.body.shape.signed_distance(particles.positions[outer]))
    return float(np.mean(depths <= _ON * body.spacing))
