"""Size of the factors of a sparse stiffness matrix, estimated: in a band or by nested dissection.

In a band each layer across the longest side is coupled to those within the reach of the stiffness.
George (1973), Nested dissection of a regular finite element mesh: the unknowns eliminated last form
a layer across the longest side, as thick as the reach of the stiffness. Its block is full. The two
halves are dissected in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import attrs

from solidsph.maths.band import MOST_IN_BAND


@attrs.frozen
class Factorisation:
    """Size and cost of a factorisation."""

    fill: int  # entries of both factors, or numbers in the band
    multiplications: int
    banded: bool = False


def estimate_factorisation(cells: Sequence[float], reach: float, components: int) -> Factorisation:
    """Estimate the factorisation for a box of particles, in a band if this is worth its memory.

    Args:
        cells: particles along each axis.
        reach: largest distance at which two particles interact [spacings].
        components: unknowns per particle.
    """
    count = components * prod(cells)
    width = min(count - 1.0, components * reach * prod(sorted(cells)[:-1]))
    if count * (width + 1.0) > MOST_IN_BAND:
        return estimate_dissection(cells, reach, components)
    return Factorisation(int(count * (width + 1.0)), int(0.5 * count * width**2), banded=True)


def estimate_dissection(cells: Sequence[float], reach: float, components: int) -> Factorisation:
    """Estimate the factorisation for a box of particles by nested dissection.

    Args:
        cells: particles along each axis.
        reach: largest distance at which two particles interact [spacings].
        components: unknowns per particle.
    """
    fill = multiplications = 0.0
    sides, parts = sorted(cells), 1.0
    while True:
        longest, across = sides[-1], prod(sides[:-1])
        if longest <= 2.0 * reach:  # no layer separates the halves
            size = components * longest * across
            fill += parts * size**2
            multiplications += parts * size**3 / 3.0
            return Factorisation(int(fill), int(multiplications))
        # A layer is still coupled to earlier ones of about the same size.
        size = components * reach * across
        fill += parts * 3.0 * size**2
        multiplications += parts * 7.0 / 3.0 * size**3
        sides = sorted([*sides[:-1], 0.5 * (longest - reach)])
        parts *= 2.0
