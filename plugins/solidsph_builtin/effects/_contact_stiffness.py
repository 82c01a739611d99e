"""Stiffness of the normal forces of a contact."""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array, csr_array, diags_array

from solidsph.interfaces.smoothing_kernel import COMPLEX_STEP, SmoothingKernel
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.effects._meeting import Meeting, Touch


def normal_stiffness(meeting: Meeting, touch: Touch) -> csr_array:
    """Second derivative of the energy of a meeting, (d m, d m) [N/m] for its m particles.

    K sum of V_a (grad o_a grad o_a^T + o_a grad^2 o_a) over the particles with an excess.
    """
    i, j, V, K = touch.i, touch.j, meeting.volumes, meeting.modulus
    m, d = len(V), touch.offsets.shape[1]
    steep = touch.slopes[:, None] * touch.offsets  # gradient of W by x_i (k, d)
    own = K * V * (touch.excess > 0.0)
    # Rows are the gradients of o_a.
    G = csr_array(
        _blocks(i, j, (V[j, None] * steep)[:, None, :], m, d)
        - _blocks(j, i, (V[i, None] * steep)[:, None, :], m, d)
    )
    risen = csr_array(G.T @ diags_array(own, format="csr") @ G)
    factors = K * V[i] * V[j] * (touch.excess[i] + touch.excess[j])
    bends = factors[:, None, None] * _second_derivatives(meeting.kernel, touch)
    bent = csr_array(_blocks(i, j, bends, m, d) + _blocks(j, i, bends, m, d))
    return csr_array(risen + bent)


def spread(matrix: csr_array, particles: Indices, n: int) -> csr_array:
    """A matrix (d m, d m) of some particles (m,) among the entries of all, (d n, d n)."""
    d = matrix.shape[0] // len(particles)
    places = (d * particles[:, None] + np.arange(d)).ravel()
    entries = matrix.tocoo()
    ends = places[entries.row], places[entries.col]
    return csr_array((entries.data, ends), shape=(d * n, d * n))


def _blocks(p: Indices, q: Indices, blocks: Array, m: int, d: int) -> csr_array:
    """Sum over pairs of a block (e, d) in the rows of p: plus at the columns of p, minus at q."""
    k, e = blocks.shape[:2]
    order = np.argsort(p, kind="stable")
    starts = np.searchsorted(p[order], np.arange(m + 1))
    across = bsr_array((-blocks[order], q[order], starts), shape=(e * m, d * m))
    total = np.zeros((m, e, d))
    np.add.at(total, p, blocks)
    places = np.arange(m)
    own = bsr_array((total, places, np.arange(m + 1)), shape=(e * m, d * m))
    return csr_array(csr_array(across) + csr_array(own))


def _second_derivatives(kernel: SmoothingKernel, touch: Touch) -> Array:
    """Second derivatives of W by the offset of each pair, (k, d, d) [m^-(d+2)]."""
    square = np.einsum("kc,kc->k", touch.offsets, touch.offsets)
    d, H = kernel.dimension, kernel.support_radius
    q = np.sqrt(square) / H
    stepped = kernel.kernel.slope(q + 1j * COMPLEX_STEP, kernel.kernel.params)
    curvature = np.imag(stepped) / COMPLEX_STEP * kernel.normalisation / H ** (d + 2)
    along = np.einsum("kc,ke->kce", touch.offsets, touch.offsets)
    along /= np.where(square > 0.0, square, 1.0)[:, None, None]
    # In one place W is bent alike in every direction.
    across = np.where(square > 0.0, touch.slopes, curvature)[:, None, None]
    return np.asarray(across * np.eye(d) + (curvature[:, None, None] - across) * along)
