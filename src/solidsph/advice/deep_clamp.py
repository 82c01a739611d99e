"""Held particles beyond the support of every free one: they only cost time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.maths.arrays import Mask

# Share of a body's particles that may be held without need.
_SHARE = 0.1


def deep_clamp(facts: SceneFacts) -> Iterator[Advice]:
    """Find held particles that are far from every free one."""
    for body in facts.bodies:
        real = ~body.body.particles.ghosts
        held: Mask = np.asarray(facts.held[body.extent][real].all(axis=1))
        if not held.any() or held.all():
            continue
        support = body.body.smoothing.support_radius
        gaps, _ = cKDTree(body.real[~held]).query(body.real[held], distance_upper_bound=support)
        idle = int((~np.isfinite(gaps)).sum())
        if idle > _SHARE * len(held):
            yield Advice(
                finding=f"{idle} of the {len(held)} particles of body {body.name!r} are held "
                f"farther than the support, {support:.3g} m, from every free one",
                expected=f"held to a depth of {np.ceil(facts.cover):g} particles",
                remedy="shorten the body there, or hold less of it",
            )
