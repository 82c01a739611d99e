"""The size of a body, by which engines choose."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.plan import BodySize
from solidsph.interfaces.smoothing_kernel import UNIT_SPHERE


def size_of(body: Body) -> BodySize:
    """The size of a body; the pairs are counted as if all supports were complete."""
    d = body.smoothing.dimension
    radii = body.smoothing.radii
    H = body.smoothing.support_radius**d if radii is None else np.mean(radii**d)
    ball = UNIT_SPHERE[d] / d * H
    return BodySize(
        dimension=d,
        particles=body.particles.count,
        pairs=float(body.particles.count * ball / np.mean(body.particles.volumes)),
        moving=body.formulation.configuration is Configuration.CURRENT,
        filters=body.dilatation_filter is not None,
    )
