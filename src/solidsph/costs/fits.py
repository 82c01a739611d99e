"""Whether a scene fits into the memory that is free, said before any of it is taken."""

from __future__ import annotations

from math import ceil

import numpy as np

from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.estimated import estimated
from solidsph.costs.model import predicted
from solidsph.costs.process import available_memory
from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.registry.construct import construct
from solidsph.scene.scene import Scene

# Particles up to which a scene is not priced: at 20 kB each, the most that any takes, some 400 MB.
_FEW = 2e4

# A prediction on paper errs; what lies within a fifth of what is free is left to the run.
_ERROR = 1.2


def check_fits(scene: Scene) -> None:
    """Raise SceneError if a run of `scene` is predicted to need far more memory than is free.

    Nothing is built, and nothing is said of a scene that is wrong: the build will tell.
    """
    try:
        if _boxed(scene) <= _FEW:
            return
        work = estimated(scene)
        needed = predicted(work, REFERENCE).memory
    except Exception:
        return
    free = available_memory()
    if needed <= _ERROR * free:
        return
    # What a run takes grows with the number of particles.
    larger = ceil(20.0 * (needed / max(free, 1)) ** (1.0 / work.dimension)) / 20.0
    raise SceneError(
        f"{work.particles:.3g} particles and {work.pairs:.3g} pairs need about "
        f"{needed / 2**30:.3g} GiB, and this machine has {free / 2**30:.3g} GiB free; a spacing "
        f"{larger:.3g} times as large fits. `solidsph explain` prices the scene on a cluster, and "
        "`solidsph run --beyond-memory` runs it all the same"
    )


def _boxed(scene: Scene) -> float:
    """Particles that would fill the boxes around all bodies."""
    count = 0.0
    for body in scene.bodies.values():
        shape: Shape = construct("shapes", body.shape)
        lower, upper = shape.bounds()
        count += float(np.prod(np.maximum(1.0, (upper - lower) / body.spacing)))
    return count
