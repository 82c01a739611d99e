"""A support so large that the gradient is blind to neighbours in a row, or not worth its cost."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts
from solidsph.interfaces.effect import Need
from solidsph.interfaces.formulation import Configuration
from solidsph.scene.default_cover import BLIND, kernel_cover, wave_number_ratio

# Beyond these, in spacings, a kernel smooths details away and each evaluation costs several times
# that of the usual 3.
_MOST = {1: 8.0, 2: 4.6, 3: 4.0}

# Neighbours in moving supports pair beyond these, if the kernel's transform changes its sign.
_PAIRING = {1: 6.0, 2: 4.0, 3: 3.3}

_USUAL = 3.0


def large_cover(facts: SceneFacts) -> Iterator[Advice]:
    """Check what the gradient holds on a lattice in rows, and the number of neighbours."""
    d, cover = facts.dimension, facts.cover
    body = facts.simulation.model.bodies[0]
    kernel = body.smoothing.kernel
    share = wave_number_ratio(kernel, d, cover)
    # Sums that are right at the surface cause no saw-tooth there.
    if share < BLIND and not facts.fits_surface and facts.lacks(Need.UNSEEN_MOTIONS):
        # Next neighbours alone would hold waves by 2 / pi of their wave number.
        part = max(0.0, 50.0 * np.pi * share)
        best = kernel_cover(kernel)
        yield Advice(
            finding=f"with cover = {cover:g}, {type(kernel).__name__} in {d}D holds neighbours in "
            f"a row against each other at {part:.2g} % of the frequency that next neighbours alone "
            "would: their displacements are off by several times their difference",
            expected=f"{50.0 * np.pi * BLIND:.2g} % or more, as at cover = {best:g}",
            remedy=f"cover = {best:g}, or add [[effect]] 'hourglass-control'",
        )
        return
    moving = body.formulation.configuration is Configuration.CURRENT
    pairs = moving and not kernel.nonnegative_transform
    most = _PAIRING[d] if pairs else _MOST[d]
    if cover <= most:
        return
    times = (cover / _USUAL) ** d
    why = ", and neighbours that move pair with this kernel" if pairs else ""
    yield Advice(
        finding=f"cover = {cover:g} in {d}D: {times:.2g} times the pairs of cover = {_USUAL:g}"
        f"{why}",
        expected=f"at most {most:g}; a finer spacing gains more for the same cost",
        remedy=f"cover = {_USUAL:g}, or a little more",
    )
