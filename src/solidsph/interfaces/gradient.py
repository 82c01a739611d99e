"""Gradient: how the derivative of a field is formed from its values at the neighbours."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from solidsph.arrays import Array
from solidsph.neighbours import Pairs

if TYPE_CHECKING:
    from solidsph.body import Body


class Gradient(ABC):
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

    def of_body(self, body: Body) -> Gradient:
        """The gradient as `body` uses it: itself, unless it depends on the body as a whole.

        Raises:
            BuildError: it does, and cannot be formed on this body.
        """
        return self
