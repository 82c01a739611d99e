"""A support so large that it costs more than it gives, or lets neighbours pair."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.seen import Seen
from solidsph.interfaces.formulation import Configuration

# Beyond these, in spacings, a kernel smooths details away and each evaluation costs several times
# what it does at the usual 3.
_MOST = {1: 8.0, 2: 4.6, 3: 4.0}

# Neighbours in moving supports pair beyond these, if the kernel's transform changes its sign.
_PAIRING = {1: 6.0, 2: 4.0, 3: 3.3}

_USUAL = 3.0


def large_cover(seen: Seen) -> Iterator[Advice]:
    """By the neighbours that it brings."""
    d, cover = seen.dimension, seen.scene.cover
    body = seen.simulation.setting.bodies[0]
    moving = body.formulation.configuration is Configuration.CURRENT
    pairs = moving and not body.smoothing.kernel.nonnegative_transform
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
