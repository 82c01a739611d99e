"""A support so large that it is blind to neighbours in a row, lets them pair, or costs too much."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.advice.advice import Advice
from solidsph.advice.seen import Seen
from solidsph.interfaces.effect import Need
from solidsph.interfaces.formulation import Configuration
from solidsph.scene.default_cover import BLIND, kernel_cover, wave_number_ratio

# Beyond these, in spacings, a kernel smooths details away and each evaluation costs several times
# what it does at the usual 3.
_MOST = {1: 8.0, 2: 4.6, 3: 4.0}

# Neighbours in moving supports pair beyond these, if the kernel's transform changes its sign.
_PAIRING = {1: 6.0, 2: 4.0, 3: 3.3}

_USUAL = 3.0


def large_cover(seen: Seen) -> Iterator[Advice]:
    """By what the gradient holds on a lattice in rows, and by the neighbours that it brings."""
    d, cover = seen.dimension, seen.cover
    body = seen.simulation.model.bodies[0]
    kernel = body.smoothing.kernel
    share = wave_number_ratio(kernel, d, cover)
    # Sums that end right at the surface set off no saw-tooth there.
    if share < BLIND and not seen.fits_surface and seen.lacks(Need.UNSEEN_MOTIONS):
        # Where only the next neighbours act, waves are held by 2 / pi of their wave number.
        part = max(0.0, 50.0 * np.pi * share)
        best = kernel_cover(kernel)
        yield Advice(
            found=f"with cover = {cover:g}, {type(kernel).__name__} in {d}D holds neighbours in a "
            f"row against each other at {part:.2g} % of the frequency that next neighbours alone "
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
        found=f"cover = {cover:g} in {d}D: {times:.2g} times the pairs of cover = {_USUAL:g}{why}",
        expected=f"at most {most:g}; a finer spacing gains more for the same cost",
        remedy=f"cover = {_USUAL:g}, or a little more",
    )
