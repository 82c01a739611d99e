"""Stiffness of the forces of a contact."""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array, csr_array, diags_array

from solidsph.interfaces.smoothing_kernel import COMPLEX_STEP, SmoothingKernel
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.effects._meeting import Meeting, Rubbing, Touch
from solidsph_builtin.effects._room import Near
from solidsph_builtin.effects._slip import slip_stiffness


def normal_stiffness(meeting: Meeting, touch: Touch) -> csr_array:
    """Second derivative of the energy of a meeting, (d m, d m) [N/m] for its m particles.

    K sum of V_a (grad o_a grad o_a^T + o_a grad^2 o_a) over the particles with an excess.
    """
    near, beyond, V = touch.near, touch.beyond, meeting.volumes
    i, j, m, d = near.i, near.j, len(V), near.offsets.shape[1]
    own = meeting.modulus * V
    G = _gradients(near, V, *beyond.slopes)
    active = diags_array(own * (beyond.excess > 0.0), format="csr")
    total = csr_array(G.T @ active @ G)
    pressures = meeting.modulus * beyond.excess
    both = pressures[i] * beyond.factors[0] + pressures[j] * beyond.factors[1]
    bends = (V[i] * V[j] * both)[:, None, None] * _second_derivatives(meeting.kernel, near)
    total = csr_array(total + _blocks(i, j, bends, m, d) + _blocks(j, i, bends, m, d))
    if beyond.bend is not None:
        # grad^2 o has the part grad S (grad S - grad o)^T / S and its transpose.
        S = _gradients(near, V, near.slopes, near.slopes)
        turned = S.T @ diags_array(V * pressures * beyond.bend, format="csr") @ csr_array(S - G)
        total = csr_array(total + turned + turned.T)
    return total


def friction_stiffness(
    meeting: Meeting, touch: Touch, x: Array, v: Array, slip: Array, step: float, friction: float
) -> csr_array | None:
    """Minus the derivative of `Meeting.rubbed` by x, with v that changes by that over the step.

    Where the other body is around a particle, and the normals, count as constant: they turn by the
    motion over the reach of the contact. It is not symmetric where springs slide.
    """
    if step == 0.0 or not touch.excess.any():
        return None
    rub = meeting.rubbing(touch, x, v, friction)
    own = rub.own
    springs = slip_stiffness(
        slip[own], step * rub.relative, rub.normals, meeting.spring[own], rub.limits
    )
    relative = _relative_motion(meeting, touch, rub, x)
    rises = csr_array(_gradients(touch.near, meeting.volumes, *touch.beyond.slopes)[own])
    by_limit = csr_array(_diagonal(springs.by_limit[:, :, None] * rub.rise[:, None, None]) @ rises)
    pulls = csr_array(_diagonal(springs.by_motion) @ relative + by_limit)
    return csr_array(relative.T @ pulls)


def _relative_motion(meeting: Meeting, touch: Touch, rub: Rubbing, x: Array) -> csr_array:
    """Motion of particles relative to the rigid motion of the other body around them, by the
    motion of all, (d k, d m)."""
    (m, d), count = x.shape, len(rub.own)
    number = np.full(m, -1)
    number[rub.own] = np.arange(count)
    near = touch.near
    p = np.concatenate([near.i, near.j])
    q = np.concatenate([near.j, near.i])
    W = np.concatenate([near.values, near.values])
    held = number[p] >= 0
    n, q, W = number[p[held]], q[held], W[held]
    places, around = rub.places[n], rub.around
    share = meeting.volumes[q] * W / around.total[places]
    centre = around.centre[places]
    inertia = around.inertia[places]
    if d == 2:
        inertia = inertia[:, 2:, 2:]
    arm = _cross(x[rub.own[n]] - centre)
    lever = np.linalg.solve(inertia, _cross(x[q] - centre))
    # Rigid: v + w x arm, with inertia w = sum of shares lever x v.
    blocks = share[:, None, None] * (np.eye(d) + arm.transpose(0, 2, 1) @ lever)
    order = np.argsort(n, kind="stable")
    starts = np.searchsorted(n[order], np.arange(count + 1))
    around_them = bsr_array((blocks[order], q[order], starts), shape=(d * count, d * m))
    themselves = bsr_array(
        (np.tile(np.eye(d), (count, 1, 1)), rub.own, np.arange(count + 1)),
        shape=(d * count, d * m),
    )
    return csr_array(csr_array(themselves) - csr_array(around_them))


def _cross(r: Array) -> Array:
    """Matrices of the cross product with vectors r (k, d): (k, 3, 3), or (k, 1, 2) in the plane."""
    if r.shape[1] == 2:
        return np.stack([-r[:, 1], r[:, 0]], axis=1)[:, None, :]
    x, y, z = r.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def _diagonal(blocks: Array) -> csr_array:
    """Matrix of blocks (k, a, b) on its diagonal."""
    k, a, b = blocks.shape
    return csr_array(bsr_array((blocks, np.arange(k), np.arange(k + 1)), shape=(a * k, b * k)))


def _gradients(near: Near, V: Array, of_i: Array, of_j: Array) -> csr_array:
    """Of sums over pairs whose derivatives by distance, over V and the distance, are `of_i` for
    the sum of i and `of_j` for that of j (k,): by all places, (m, d m) [1/m]."""
    i, j, m, d = near.i, near.j, len(V), near.offsets.shape[1]
    forth = _blocks(i, j, ((V[j] * of_i)[:, None] * near.offsets)[:, None, :], m, d)
    back = _blocks(j, i, ((V[i] * of_j)[:, None] * near.offsets)[:, None, :], m, d)
    return csr_array(forth - back)


def spread(matrix: csr_array, particles: Indices, n: int) -> csr_array:
    """A matrix (d m, d m) of some particles (m,) among the entries of all, (d n, d n)."""
    d = matrix.shape[0] // len(particles)
    places = (d * particles[:, None] + np.arange(d)).ravel()
    entries = matrix.tocoo()
    ends = places[entries.row], places[entries.col]
    return csr_array((entries.data, ends), shape=(d * n, d * n))


def _blocks(p: Indices, q: Indices, blocks: Array, m: int, d: int) -> csr_array:
    """Sum over pairs of a block (e, d) in the rows of p: plus at the columns of p, minus at q."""
    e = blocks.shape[1]
    order = np.argsort(p, kind="stable")
    starts = np.searchsorted(p[order], np.arange(m + 1))
    across = bsr_array((-blocks[order], q[order], starts), shape=(e * m, d * m))
    total = np.zeros((m, e, d))
    np.add.at(total, p, blocks)
    places = np.arange(m)
    own = bsr_array((total, places, np.arange(m + 1)), shape=(e * m, d * m))
    return csr_array(csr_array(across) + csr_array(own))


def _second_derivatives(kernel: SmoothingKernel, near: Near) -> Array:
    """Second derivatives of W by the offset of each pair, (k, d, d) [m^-(d+2)]."""
    square = np.einsum("kc,kc->k", near.offsets, near.offsets)
    d, H = kernel.dimension, near.reaches
    q = np.sqrt(square) / H
    stepped = np.asarray(kernel.kernel.slope(q + 1j * COMPLEX_STEP, kernel.kernel.params))
    curvature = np.imag(stepped) / COMPLEX_STEP * kernel.normalisation / H ** (d + 2)
    along = np.einsum("kc,ke->kce", near.offsets, near.offsets)
    along /= np.where(square > 0.0, square, 1.0)[:, None, None]
    # In one place W is bent alike in every direction.
    across = np.where(square > 0.0, near.slopes, curvature)[:, None, None]
    return np.asarray(across * np.eye(d) + (curvature[:, None, None] - across) * along)
