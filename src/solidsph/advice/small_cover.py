"""A support too small for the kernel: sums over neighbours are wrong."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.smoothing_kernel import SmoothingKernel, smoothing_kernel
from solidsph.maths.arrays import Array

# Kernels in use stay below this in 1, 2 and 3D from the covers on that they are known to work with.
_WRONG = 0.03

# Where in a cell of the lattice the sum is taken, in spacings.
_PLACES = (0.0, 0.25, 0.5)


def small_cover(facts: SceneFacts) -> Iterator[Advice]:
    """Sum the kernel over a lattice; the sum should be 1."""
    own = facts.simulation.model.bodies[0].smoothing
    error = _error(own, facts.cover)
    if error <= _WRONG:
        return
    enough = next(
        (
            cover
            for cover in np.arange(np.ceil(10.0 * facts.cover), 60.0) / 10.0
            if _error(smoothing_kernel(own.kernel, own.dimension, cover), cover) <= _WRONG
        ),
        None,
    )
    yield Advice(
        finding=f"with cover = {facts.cover:g} the kernel's sum over a lattice is "
        f"{100 * error:.2g} % off",
        expected=f"at most {100 * _WRONG:g} %: a smooth kernel needs more neighbours",
        remedy="choose another kernel" if enough is None else f"cover = {enough:.2g} or more",
    )


def _error(kernel: SmoothingKernel, cover: float) -> float:
    """Largest difference of the sum over neighbours from 1 [-]."""
    d, spacing = kernel.dimension, kernel.support_radius / cover
    along = np.arange(-np.ceil(cover) - 1.0, np.ceil(cover) + 2.0)
    lattice: Array = np.array(list(product(along, repeat=d)))
    sums = [
        float(kernel.value(spacing * np.linalg.norm(lattice + shift, axis=1)).sum()) * spacing**d
        for shift in _PLACES
    ]
    lost = kernel.kernel.lost_mass(d)
    return max(abs(total - 1.0 + lost) for total in sums)
