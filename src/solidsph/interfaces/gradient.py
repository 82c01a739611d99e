"""Gradient: how the derivative of a field is formed from its values at the neighbours."""

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

    @property
    @abstractmethod
    def exact_degree(self) -> int:
        """Highest degree of a polynomial whose gradient is exact at every particle, on any
        arrangement and at free surfaces; -1 if not even a constant has gradient zero."""

    @abstractmethod
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        """Weight vector of every pair, (m, d) [1/m].

        Args:
            pairs: neighbours, each particle among its own.
            kernel_gradients: (m, d), derivative of W(x_p - x_q) by x_p [m^-(d+1)].
            volumes: (n,) [m^d].

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
        """Specialise to a body; returns self unless the weights depend on the body as a whole.

        Args:
            body: its name.
            particles: its own.
            smoothing: the kernel with the body's support radius.
            pairs: finds its neighbours.
            moving: True if the sums are taken in the current configuration.

        Raises:
            BuildError: it cannot be formed on this body.
        """
        return self


class PointwiseGradient(Gradient):
    """A gradient whose weights are K_p dW/dx_p V_q, with one matrix K_p for every particle.

    Its author writes K_p and nothing else. The core forms the weights, for arrays of pairs here,
    and an engine in its own loops from the same formula.
    """

    of_differences: ClassVar[bool]
    """Whether it acts on f_q - f_p: the weight at q = p is then minus the sum of the others."""

    @staticmethod
    def correction(moment: Tensor) -> Tensor | None:
        """K_p from the moment M_p = sum over q of (x_q - x_p) (x) dW/dx_p V_q [-]; pointwise.

        Not finite where the neighbours do not determine a gradient. Without it K_p is I.
        """
        return None

    @property
    def is_corrected(self) -> bool:
        """Whether there is a K_p."""
        return self.correction(((1.0,),)) is not None

    @final
    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights: Array = kernel_gradients * volumes[pairs.columns, None]
        if self.is_corrected:
            corrections = self._corrections(pairs, weights)
            weights = np.einsum("mij,mj->mi", pairs.spread(corrections), weights)
        return pairs.of_differences(weights) if self.of_differences else weights

    def _corrections(self, pairs: Pairs, plain: Array) -> Array:
        """K_p of every particle, (n, d, d)."""
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
