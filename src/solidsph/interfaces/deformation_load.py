"""Loads by the deformation of the particles they act on, as arrays and a pointwise formula."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array

from solidsph.interfaces.plan import Operations, SumMethod
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array, Scalar, Tensor, Vector
from solidsph.maths.tensors import components_first


class DeformationLoad(Load):
    """Forces by a formula of each particle's own F, and of a number that is a function of time.

    A kind such as those of `interfaces/compilable_terms.py`.
    """

    is_counted: ClassVar[bool] = True

    @property
    @abstractmethod
    def reference(self) -> Array:
        """Reference positions X of all particles, (n, d) [m]."""

    @property
    @abstractmethod
    def gradients(self) -> Sequence[csr_array]:
        """Derivatives at its particles from values at all, (k, n) along each axis [1/m]."""

    @property
    @abstractmethod
    def values(self) -> Array:
        """Numbers of each of its particles that the formula uses, (k, m)."""

    @abstractmethod
    def schedule(self, times: Array) -> Array:
        """Numbers of its particles at `times` (t,) [s], (t, k), or (1, k) if they are constant."""

    @staticmethod
    @abstractmethod
    def force(F: Tensor, number: Scalar, values: Vector) -> Vector:
        """Force [N], a tuple of components, by the deformation gradient; pointwise."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        now, F = self.schedule(np.array([time]))[0], self.deformation(positions - self.reference)
        components = self.force(F, now, self.values.T)
        return np.column_stack([np.broadcast_to(c, len(now)) for c in components])

    def deformation(self, displacements: Array) -> Array:
        """F (d, d, k) of its particles, from displacements of all (n, d) [m]."""
        H = np.stack([gradient @ displacements for gradient in self.gradients], axis=-1)
        return components_first(H + np.eye(displacements.shape[1]))

    @property
    def pair_count(self) -> int:
        return max(gradient.nnz for gradient in self.gradients)

    @property
    def arrays(self) -> Mapping[str, int]:
        rows = sum(g.data.nbytes + g.indices.nbytes for g in self.gradients)
        return {"gradients": rows, "values": self.values.nbytes}

    def operations(self, dimension: int, *, compiled: bool) -> Sequence[Operations]:
        kept, count = sum(self.arrays.values()), len(self.particles)
        # A pass that gathers and scatters counts a pair once, and these sums only gather.
        method = SumMethod.ROWS if compiled else SumMethod.PRODUCTS
        return (Operations(method, self.pair_count // 2, count, kept, kept),)
