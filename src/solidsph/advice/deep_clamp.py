"""A clamp that holds more than anything free can see."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.maths.arrays import Mask

# Part of a body's particles that may be held for nothing.
_SHARE = 0.1


def deep_clamp(seen: SceneFacts) -> Iterator[Advice]:
    """Held particles beyond the support of every free one do nothing but cost."""
    for one in seen.bodies:
        extent = one.body.extent
        real = ~one.body.particles.ghosts
        held: Mask = np.asarray(seen.freedoms[extent][real].all(axis=1))
        if not held.any() or held.all():
            continue
        support = one.body.smoothing.support_radius
        away, _ = cKDTree(one.real[~held]).query(one.real[held], distance_upper_bound=support)
        idle = int((~np.isfinite(away)).sum())
        if idle > _SHARE * len(held):
            yield Advice(
                found=f"{idle} of the {len(held)} particles of body {one.name!r} are held farther "
                f"than the support, {support:.3g} m, from every free one",
                expected=f"held to a depth of {np.ceil(seen.cover):g} particles",
                remedy="shorten the body there, or hold less of it",
            )
