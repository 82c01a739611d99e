"""Check before a build that a run fits into the free memory."""

from __future__ import annotations

from math import ceil

import numpy as np

from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.estimate import estimate_work
from solidsph.costs.model import predict
from solidsph.costs.process import available_memory
from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.registry.construct import construct
from solidsph.scene.graded_spacing import least_spacing
from solidsph.scene.scene import Scene

# Smaller scenes always fit: at 20 kB a particle, the most that any needs, this is some 400 MB.
_FEW = 2e4

# Allowance for the error of an estimate: a run that needs up to a fifth more is let through.
_ERROR = 1.2


def check_memory(scene: Scene) -> None:
    """Raise SceneError if a run of `scene` is predicted to need far more memory than is free.

    Nothing is built. A scene with mistakes passes: the build reports them.
    """
    try:
        if _count_in_boxes(scene) <= _FEW:
            return
        work = estimate_work(scene)
        needed = predict(work, REFERENCE).memory
    except Exception:
        return
    free = available_memory()
    if needed <= _ERROR * free:
        return
    # Memory is proportional to the number of particles.
    factor = ceil(20.0 * (needed / max(free, 1)) ** (1.0 / work.dimension)) / 20.0
    raise SceneError(
        f"{work.particles:.3g} particles and {work.pairs:.3g} pairs need about "
        f"{needed / 2**30:.3g} GiB of memory, but only {free / 2**30:.3g} GiB are free; multiply "
        f"the spacing by {factor:.3g}. `solidsph explain` predicts the run on a cluster, and "
        "`solidsph run --beyond-memory` runs the scene anyway"
    )


def _count_in_boxes(scene: Scene) -> float:
    """Number of particles that would fill the bounding boxes of all bodies."""
    count = 0.0
    for body in scene.bodies.values():
        shape: Shape = construct("shapes", body.shape)
        lower, upper = shape.bounds()
        count += float(np.prod(np.maximum(1.0, (upper - lower) / least_spacing(body))))
    return count
