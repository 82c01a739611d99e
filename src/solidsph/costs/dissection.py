"""Factors of a sparse stiffness, estimated by cutting a box of particles in halves again.

George (1973), Nested dissection of a regular finite element mesh: what is eliminated last is a
layer across the longest side, as thick as the stiffness reaches; its block is full. The halves on
both sides are treated in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import attrs


@attrs.frozen
class Factorisation:
    """What a factorisation takes."""

    fill: int  # entries of both factors
    multiplications: int


def dissected(cells: Sequence[float], reach: float, components: int) -> Factorisation:
    """Of a box of so many particles along each side.

    Args:
        cells: particles along each axis.
        reach: how many spacings apart two particles may be and act on each other.
        components: unknowns a particle.
    """
    fill = multiplications = 0.0
    sides, parts = sorted(cells), 1.0
    while True:
        longest, across = sides[-1], prod(sides[:-1])
        if longest <= 2.0 * reach:  # no layer separates it any more
            size = components * longest * across
            fill += parts * size**2
            multiplications += parts * size**3 / 3.0
            return Factorisation(int(fill), int(multiplications))
        # The layer, beside those of before that it still touches: about as many again.
        size = components * reach * across
        fill += parts * 3.0 * size**2
        multiplications += parts * 7.0 / 3.0 * size**3
        sides = sorted([*sides[:-1], 0.5 * (longest - reach)])
        parts *= 2.0
