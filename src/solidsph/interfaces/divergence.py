"""Divergence: how forces are formed from the stresses at the neighbours."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, final

import numpy as np

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Array, Scalar
from solidsph.model.neighbours import Pairs


class Divergence(Part):
    """Weights d_pq of the discrete force, f_p = sum over q of T_q d_pq."""

    conserves_momentum: ClassVar[bool]
    """True if the forces of a free body add up to zero for any stresses, provided that the
    gradient of a constant is zero."""

    adjoint: ClassVar[bool]
    """True if the weights are -V_q g_qp. An engine may then scatter with the weights of the
    gradient and store no others."""

    uses_ghost_stress: ClassVar[bool]
    """True if ghosts carry a stress of their own into the sums. Otherwise the forces on ghosts
    are returned to the particles that the ghosts follow."""

    @abstractmethod
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        """Weight vector d_pq of every pair, (m, d) [m^(d-1)].

        Args:
            pairs: neighbour pairs, self pairs included.
            gradient_weights: g_pq of the formulation's gradient, (m, d) [1/m].
            volumes: particle volumes, (n,) [m^d].
        """


class PointwiseDivergence(Divergence):
    """A divergence whose weight at a pair depends on the gradient weights of that pair only.

    The author writes formulas for one component; the core or an engine forms the weights.
    """

    @staticmethod
    @abstractmethod
    def pair_weight(there: Scalar, back: Scalar, volume: Scalar, other: Scalar) -> Scalar:
        """A component of d_pq for p not q, from those of g_pq and g_qp and from V_p and V_q."""

    @staticmethod
    @abstractmethod
    def own_weight(own: Scalar, volume: Scalar) -> Scalar:
        """A component of d_pp, from that of g_pp and from V_p."""

    @final
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        weights = np.array(
            self.pair_weight(
                gradient_weights,
                gradient_weights[pairs.reversed_order()],
                volumes[pairs.rows, None],
                volumes[pairs.columns, None],
            )
        )
        own = pairs.self_pairs
        weights[own] = self.own_weight(gradient_weights[own], volumes[:, None])
        return weights
