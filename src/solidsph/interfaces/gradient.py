"""Gradient: how the gradient of a field is formed from its values at the neighbours."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from solidsph.errors import BuildError
from solidsph.interfaces.part import Part
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Mask, Tensor
from solidsph.maths.tensors import components_first, particles_first
from solidsph.model.neighbours import Pairs
from solidsph.model.particles import Particles


class Gradient(Part):
    """Weights g_pq of the discrete gradient, grad f at p = sum over q of f_q g_pq."""

    cover_in_space: ClassVar[float] = 1.0
    """Part of a kernel's usual cover that suits it in three dimensions [-]."""

    @property
    @abstractmethod
    def exact_degree(self) -> int:
        """Highest degree of polynomials whose gradient is exact at every particle.

        For any arrangement and at free surfaces; -1 if not even a constant has gradient zero.
        """

    @property
    def deep_inside(self) -> Gradient:
        """As it is far from every surface of a lattice; self, the default, unless `of_body` returns
        one that is the same as another there."""
        return self

    @abstractmethod
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        """Weight vector g_pq of every pair, (m, d) [1/m].

        Args:
            pairs: neighbour pairs, self pairs included.
            kernel_gradients: derivatives of W(x_p - x_q) by x_p, (m, d) [m^-(d+1)].
            volumes: particle volumes, (n,) [m^d].

        Raises:
            BuildError: the neighbours of a particle do not determine a gradient.
        """

    def of_body(
        self,
        body: str,
        particles: Particles,
        smoothing: SmoothingKernel,
        pairs: Callable[[], Pairs],
        *,
        moving: bool,
    ) -> Gradient:
        """Specialise to a body; return self, the default, unless the weights depend on all of it.

        Args:
            body: name of the body.
            particles: its particles.
            smoothing: the kernel with the body's support radius.
            pairs: searches its neighbour pairs.
            moving: True if the sums are taken in the current configuration.

        Raises:
            BuildError: the gradient cannot be formed on this body.
        """
        return self


class PointwiseGradient(Gradient):
    """A gradient whose weights are K_p dW/dx_p V_q, with one matrix K_p per particle.

    The author writes K_p only. The core forms the weights for arrays of pairs, and an engine may
    use the same formula in its own loops.
    """

    of_differences: ClassVar[bool]
    """True if it acts on f_q - f_p: the weight at q = p is then minus the sum of the others."""

    @staticmethod
    def correction(moment: Tensor) -> Tensor | None:
        """K_p from the moment M_p = sum over q of (x_q - x_p) (x) dW/dx_p V_q [-]; pointwise.

        It must not be finite where the neighbours do not determine a gradient. None, the default,
        for K_p = I.
        """
        return None

    @property
    def is_corrected(self) -> bool:
        """True if K_p is not the identity."""
        return self.correction(((1.0,),)) is not None

    @final
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights: Array = kernel_gradients * volumes[pairs.columns, None]
        if self.is_corrected:
            corrections = self._corrections(pairs, weights)
            weights = np.einsum("mij,mj->mi", pairs.spread(corrections), weights)
        return pairs.of_differences(weights) if self.of_differences else weights

    def _corrections(self, pairs: Pairs, plain: Array) -> Array:
        """K_p of every particle, (n, d, d); `plain` are the weights without it, (m, d)."""
        moments = pairs.row_sums(pairs.offsets[:, :, None] * plain[:, None, :])
        with np.errstate(all="ignore"):  # a moment without an inverse is reported below
            K = particles_first(self.correction(components_first(moments)), pairs.row_count)
        undetermined: Mask = np.any(~np.isfinite(K), axis=(1, 2))
        if undetermined.any():
            first = int(np.flatnonzero(undetermined)[0])
            neighbours = int(pairs.starts[first + 1] - pairs.starts[first]) - 1
            worst = int(pairs.rows[pairs.starts[first]])
            raise BuildError(
                [
                    f"gradient {type(self).__name__}: the {neighbours} neighbours of particle "
                    f"{worst} do not span {moments.shape[1]} dimensions "
                    f"({int(undetermined.sum())} such particles); a larger cover or a finer "
                    "spacing gives them neighbours in every direction"
                ]
            )
        return K
