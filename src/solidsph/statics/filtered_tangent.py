"""What a filter of the dilatation adds to the tangent of a body."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np
from scipy.sparse import bsr_array, csr_array

from solidsph.maths.arrays import Array
from solidsph.model.dilatation_filter import DilatationFilter

# What the filter takes where the smooth part cannot be had, as for one particle alone.
_ALONE = 0.96


@attrs.frozen(eq=False)
class Coupling:
    """What stresses change with the dilatation of neighbours, dP = kappa g (S S - 1)(g : dF)."""

    filter: DilatationFilter
    slopes: Array  # g (n, d, d)

    def change(self, dF: Array) -> Array:
        """dP (n, d, d) [Pa] of dF (n, d, d)."""
        return self.filter.coupled(self.slopes, dF)

    def matrix(self, gradients: bsr_array) -> csr_array:
        """Of stresses (d d n) by displacements, from the matrix of their gradients."""
        g = _columns(self.slopes)
        return csr_array(g @ (self.filter.matrix @ (g.T @ gradients)))

    @property
    def alone(self) -> Array:
        """Moduli (n, d, d, d, d) [Pa] in its place, where S is a number: what preconditions."""
        both = np.einsum("pik,pjl->pikjl", self.slopes, self.slopes)
        return np.asarray(-_ALONE * self.filter.modulus * both)


def add_filter(filter: DilatationFilter, F: Array, moduli: Array) -> Coupling:
    """Add the part of each particle alone to its moduli (n, d, d, d, d) [Pa] at F (n, d, d); the
    rest."""
    g, q = filter.slopes(F), filter.pressures(F)
    for j, k, unit in _units(F):
        moduli[..., j, k] += q[:, None, None] * filter.bends(F, unit)
    return Coupling(filter, g)


def _units(F: Array) -> Iterator[tuple[int, int, Array]]:
    d = F.shape[1]
    for j in range(d):
        for k in range(d):
            unit = np.zeros((d, d))
            unit[j, k] = 1.0
            yield j, k, np.broadcast_to(unit, F.shape)


def _columns(tensors: Array) -> csr_array:
    """Tensors (n, d, d) as a matrix (d d n, n): that of each particle in its own column."""
    n, d = tensors.shape[:2]
    rows = np.arange(d * d * n)
    return csr_array((tensors.ravel(), (rows, rows // (d * d))), shape=(d * d * n, n))
