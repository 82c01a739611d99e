"""Choice of the operator for hourglass forces by the size of the body."""

from __future__ import annotations

from solidsph.engines.sizes import size_of
from solidsph.interfaces.hourglass_energy import (
    HourglassOperator,
    HourglassPairs,
    HourglassProducts,
)

# Compiled sweeps take about 10 s to compile and are about 30 ns per pair faster than products: from
# this number of pairs on they pay within about a thousand evaluations.
_PAIRS_FOR_PRODUCTS = 300_000


def hourglass_operator(pairs: HourglassPairs) -> HourglassOperator:
    """The operator of these pairs that suits the size of the body."""
    if size_of(pairs.body).pairs < _PAIRS_FOR_PRODUCTS:
        return HourglassProducts.of(pairs)
    from solidsph.engines.compiled.hourglass_sweeps import HourglassSweeps  # brings the compiler

    return HourglassSweeps.of(pairs)
