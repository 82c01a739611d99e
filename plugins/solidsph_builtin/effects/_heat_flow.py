"""Heat flow between many particles, once a pair, by a compiled pass."""

from __future__ import annotations

from functools import cache
from typing import Any, final

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.engines.compiled.fixed.lane_arithmetic import chosen
from solidsph.engines.compiled.fixed.partition import thread_count
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import PairBundles, pair_bundles, sums_for
from solidsph.engines.compiled.pair_pass import pair_pass
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices


@final
@attrs.frozen(eq=False)
class HeatFlow:
    """K T for a symmetric K whose rows add up to zero."""

    pairs: PairBundles
    shares: Indices  # of threads
    temperatures: Array  # with room for bundles that reach beyond the last particle [K]
    sums: Array  # of every thread [W]
    flows: Array  # to every particle [W]

    @classmethod
    def of(cls, conduction: csr_array) -> HeatFlow:
        """The flow by this K (n, n) [W/K]."""
        entries = conduction.tocoo()
        apart = entries.row != entries.col
        table = PairTable.of(
            entries.row[apart],
            entries.col[apart],
            entries.data[apart][:, None],
            conduction.shape[0],
        )
        pairs = pair_bundles(table)
        shares = pairs.shares(thread_count(conduction.nnz))
        room = np.zeros(pairs.padded)
        return cls(pairs, shares, room, sums_for(shares, 1), np.zeros_like(room))

    def __matmul__(self, temperature: Array) -> Array:
        n = len(temperature)
        self.temperatures[:n] = temperature
        run = _pass(len(self.shares) > 1)
        run(self.shares, self.pairs, self.temperatures, self.sums, self.flows)
        return self.flows[:n]


@cache
def _pass(threaded: bool) -> Any:
    return pair_pass(njit(error_model="numpy")(_between), 1, 1, 1, True, threaded)


def _between(a: Any, b: Any, values: Any, bits: Any) -> Any:
    flow = chosen(values[0] * (b[0] - a[0]), bits)
    return (flow,), (-1.0 * flow,)
