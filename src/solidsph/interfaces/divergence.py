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
    """Whether the forces of a free body add up to zero whatever the stresses are, provided that
    the gradient of a constant is zero."""

    adjoint: ClassVar[bool]
    """Whether the weights are -V_q g_qp: an engine may then scatter with the gradient's own
    weights and store no others."""

    uses_ghost_stress: ClassVar[bool]
    """Whether ghosts carry a stress of their own into the sums. Where they do not, the forces on
    ghosts go back to the particles that the ghosts follow."""

    @abstractmethod
    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        """Weight vector of every pair, (m, d) [m^(d-1)].

        Args:
            pairs: neighbours, each particle among its own.
            gradient_weights: (m, d), those of the formulation's gradient [1/m].
            volumes: (n,) [m^d].
        """


class PointwiseDivergence(Divergence):
    """A divergence whose weight at a pair depends on the gradient's weights of that pair only.

    As with a pointwise gradient, its author writes formulas of one component, and the core or an
    engine forms the weights from them.
    """

    @staticmethod
    @abstractmethod
    def pair_weight(there: Scalar, back: Scalar, volume: Scalar, other: Scalar) -> Scalar:
        """A component of d_pq, p not q, from those of g_pq and g_qp and from V_p and V_q."""

    @staticmethod
    @abstractmethod
    def own_weight(own: Scalar, volume: Scalar) -> Scalar:
        """A component of d_pp from that of g_pp and from V_p."""

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
