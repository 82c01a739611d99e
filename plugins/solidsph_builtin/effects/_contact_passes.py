"""Compiled passes over the pairs of a contact."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import compiled_function, numbers_type
from solidsph.interfaces.kernel import Kernel
from solidsph.maths.arrays import Array


class Passes(NamedTuple):
    """Compiled passes; i, j (k,) are the particles of each pair, of (m,) in all."""

    # (x, i, j, reaches (k,), normalisation, params) -> places in the lists, i, j, offsets
    # x_i - x_j (k, d), W (k,), dW/dr / r (k,) of those within reach
    near: Any
    filled: Any  # (i, j, W, V (m,)) -> volume fraction of the others around each, (m,)
    # (i, j, W, V, room that j leaves i (k,), room that i leaves j) -> their sums with V W, (m,)
    left: Any
    # (i, j, offsets, derivatives of o_i and of o_j over V and the distance, V, pressures K o (m,))
    # -> force on i, (k, d)
    pushes: Any
    summed: Any  # (i, j, pushes, m) -> force on each, opposite on j, (m, d)
    # (i, j, offsets, W, derivatives as in `pushes`, V, excess, x, v, least moments of inertia (m,)
    # [m^2]) -> `Surroundings` of those with an excess
    surroundings: Any
    # (surroundings, i, j, W, V, x, forces (m, d), pull (count, d)): the reactions to these pulls
    react: Any


STILL, MOVED, NOT_FINITE = range(3)


@njit
def change(before: Array, x: Array, largest: float) -> int:
    """Whether a particle has moved further than `largest` [m] between positions (m, d) [m]."""
    state = STILL
    for p in range(len(x)):
        square = 0.0
        for c in range(x.shape[1]):
            square += (x[p, c] - before[p, c]) ** 2
        if not np.isfinite(square):
            return NOT_FINITE
        if square > largest**2:
            state = MOVED
    return state


class Surroundings(NamedTuple):
    """The other body around every particle with an excess: it moves there as if it were rigid."""

    number: Any  # (m,) place of a particle below, or -1
    own: Any  # (count,) the particles
    slope: Any  # (count, d) gradient of the excess [1/m]
    total: Any  # (count,) sum of V W
    centre: Any  # (count, d) [m]
    velocity: Any  # (count, d) of the other body at the particle [m/s]
    inertia: Any  # (count, 3, 3) of positions about the centre [m^2]
    sound: Any  # (count,) True if the particles around are not on a line


# Rows are told by number: a view of one takes as long as the sums.
@njit
def _add_cross(total, n, factor, a, b):
    """total[n] += factor a x b, with a and b (3,)."""
    total[n, 0] += factor * (a[1] * b[2] - a[2] * b[1])
    total[n, 1] += factor * (a[2] * b[0] - a[0] * b[2])
    total[n, 2] += factor * (a[0] * b[1] - a[1] * b[0])


@njit
def _add_turning(total, n, factor, w, k, r, dimension):
    """total[n] += factor w[k] x r with r (3,), of which the plane has two components."""
    x, y, z = factor * w[k, 0], factor * w[k, 1], factor * w[k, 2]
    total[n, 0] += y * r[2] - z * r[1]
    total[n, 1] += z * r[0] - x * r[2]
    if dimension > 2:
        total[n, 2] += x * r[1] - y * r[0]


@njit
def _minors(M):
    """Of a symmetric matrix (3, 3): the rows of its adjugate."""
    a, b, c = M[0, 0], M[1, 1], M[2, 2]
    f, g, h = M[1, 2], M[0, 2], M[0, 1]
    return (
        (b * c - f * f, f * g - h * c, h * f - b * g),
        (f * g - h * c, a * c - g * g, g * h - a * f),
        (h * f - b * g, g * h - a * f, a * b - h * h),
    )


@njit
def _is_sound(M, dimension, floor):
    """True if the least moment of inertia, within a factor of 3, is above `floor` [m^2]."""
    if dimension == 2:
        return M[2, 2] > floor
    A = _minors(M)
    determinant = M[0, 0] * A[0][0] + M[0, 1] * A[1][0] + M[0, 2] * A[2][0]
    return determinant > floor * (A[0][0] + A[1][1] + A[2][2])


@njit
def _solve(M, b, dimension, x):
    """x (3,) = M^-1 b of a sound matrix; in the plane of the third component alone."""
    if dimension == 2:
        x[0], x[1], x[2] = 0.0, 0.0, b[2] / M[2, 2]
        return
    A = _minors(M)
    determinant = M[0, 0] * A[0][0] + M[0, 1] * A[1][0] + M[0, 2] * A[2][0]
    for k in range(3):
        x[k] = (A[k][0] * b[0] + A[k][1] * b[1] + A[k][2] * b[2]) / determinant


@cache
def passes(kernel: Kernel, dimension: int) -> Passes:
    """The passes for one kernel and dimension."""
    d = dimension
    number = types.float64
    w, dw = (
        compiled_function(function, number, numbers_type(len(kernel.params)))
        for function in (kernel.profile, kernel.slope)
    )

    @njit
    def near(x, i, j, reaches, normalisation, params):
        count = 0
        kept, one, other = np.empty_like(i), np.empty_like(i), np.empty_like(j)
        offsets, values, slopes = np.empty((len(i), d)), np.empty(len(i)), np.empty(len(i))
        for k in range(len(i)):
            square = 0.0
            for c in range(d):
                offsets[count, c] = x[i[k], c] - x[j[k], c]
                square += offsets[count, c] ** 2
            reach = reaches[k]
            q = np.sqrt(square) / reach
            if q < 1.0:
                norm = normalisation / reach**d
                kept[count], one[count], other[count] = k, i[k], j[k]
                values[count] = norm * w(q, params)
                slopes[count] = 0.0
                if q > 0.0:
                    slopes[count] = norm * dw(q, params) / (q * reach**2)
                count += 1
        ends = one[:count], other[:count]
        return kept[:count], *ends, offsets[:count], values[:count], slopes[:count]

    @njit
    def filled(i, j, values, volumes):
        found = np.zeros(len(volumes))
        for k in range(len(i)):
            found[i[k]] += values[k] * volumes[j[k]]
            found[j[k]] += values[k] * volumes[i[k]]
        return found

    @njit
    def left(i, j, values, volumes, of_i, of_j):
        found = np.zeros(len(volumes))
        for k in range(len(i)):
            found[i[k]] += values[k] * volumes[j[k]] * of_i[k]
            found[j[k]] += values[k] * volumes[i[k]] * of_j[k]
        return found

    @njit
    def pushes(i, j, offsets, of_i, of_j, volumes, pressures):
        found = np.empty(offsets.shape)
        for k in range(len(i)):
            both = pressures[i[k]] * of_i[k] + pressures[j[k]] * of_j[k]
            pull = volumes[i[k]] * volumes[j[k]] * both
            for c in range(d):
                found[k, c] = -pull * offsets[k, c]
        return found

    @njit
    def summed(i, j, pushes, count):
        forces = np.zeros((count, d))
        for k in range(len(i)):
            for c in range(d):
                forces[i[k], c] += pushes[k, c]
                forces[j[k], c] -= pushes[k, c]
        return forces

    @njit
    def surroundings(i, j, offsets, values, of_i, of_j, volumes, excess, x, v, floors):
        number = np.full(len(x), -1, np.intp)
        own = np.flatnonzero(excess > 0.0)
        for n in range(len(own)):
            number[own[n]] = n
        count = len(own)
        slope, total = np.zeros((count, d)), np.zeros(count)
        # Sums of r, u, r x u and of the products of r, with offsets r and velocities u from those
        # of the particle itself: in one pass, and so near that little is lost in differences.
        sums = np.zeros((count, 15))
        for k in range(len(i)):
            for p, q, sign, steep in ((i[k], j[k], 1.0, of_i[k]), (j[k], i[k], -1.0, of_j[k])):
                n = number[p]
                if n >= 0:
                    share = volumes[q] * values[k]
                    total[n] += share
                    for c in range(d):
                        slope[n, c] += volumes[q] * steep * sign * offsets[k, c]
                    rx, ux = -sign * offsets[k, 0], v[q, 0] - v[p, 0]
                    ry = rz = uy = uz = 0.0
                    if d > 1:  # constants of the compilation
                        ry, uy = -sign * offsets[k, 1], v[q, 1] - v[p, 1]
                    if d > 2:
                        rz, uz = -sign * offsets[k, 2], v[q, 2] - v[p, 2]
                    x_share, y_share, z_share = share * rx, share * ry, share * rz
                    sums[n, 0] += x_share
                    sums[n, 1] += y_share
                    sums[n, 2] += z_share
                    sums[n, 3] += share * ux
                    sums[n, 4] += share * uy
                    sums[n, 5] += share * uz
                    sums[n, 6] += y_share * uz - z_share * uy
                    sums[n, 7] += z_share * ux - x_share * uz
                    sums[n, 8] += x_share * uy - y_share * ux
                    sums[n, 9] += x_share * rx
                    sums[n, 10] += y_share * ry
                    sums[n, 11] += z_share * rz
                    sums[n, 12] += y_share * rz
                    sums[n, 13] += x_share * rz
                    sums[n, 14] += x_share * ry
        centre, mean = np.zeros((count, d)), np.zeros((count, d))
        inertia, sound = np.zeros((count, 3, 3)), np.zeros(count, np.bool_)
        reach, rate, spin = np.zeros(3), np.zeros((1, 3)), np.zeros((1, 3))
        for n in range(count):
            p, found = own[n], sums[n] / total[n]
            r, u = found[:3], found[3:6]
            for c in range(d):
                centre[n, c], mean[n, c] = x[p, c] + r[c], v[p, c] + u[c]
                reach[c] = -r[c]
            for c in range(3):
                spin[0, c] = found[6 + c]
            _add_cross(spin, 0, -1.0, r, u)
            xx, yy = found[9] - r[0] * r[0], found[10] - r[1] * r[1]
            zz, yz = found[11] - r[2] * r[2], found[12] - r[1] * r[2]
            xz, xy = found[13] - r[0] * r[2], found[14] - r[0] * r[1]
            own_inertia = inertia[n]
            own_inertia[0, 0], own_inertia[1, 1], own_inertia[2, 2] = yy + zz, xx + zz, xx + yy
            own_inertia[1, 2] = own_inertia[2, 1] = -yz
            own_inertia[0, 2] = own_inertia[2, 0] = -xz
            own_inertia[0, 1] = own_inertia[1, 0] = -xy
            sound[n] = _is_sound(own_inertia, d, floors[p])
            if sound[n]:
                _solve(own_inertia, spin[0], d, rate[0])
                _add_turning(mean, n, 1.0, rate, 0, reach, d)
        return Surroundings(number, own, slope, total, centre, mean, inertia, sound)

    @njit
    def react(around, i, j, values, volumes, x, forces, pull):
        turn, r = np.zeros((len(pull), 3)), np.zeros(3)
        f, moment = np.zeros(3), np.zeros((1, 3))
        for n in range(len(pull)):
            if around.sound[n]:
                for c in range(d):
                    r[c], f[c] = x[around.own[n], c] - around.centre[n, c], pull[n, c]
                moment[:] = 0.0
                _add_cross(moment, 0, -1.0, r, f)
                _solve(around.inertia[n], moment[0], d, turn[n])
        for k in range(len(i)):
            for p, q in ((i[k], j[k]), (j[k], i[k])):
                n = around.number[p]
                if n >= 0 and around.sound[n]:
                    share = volumes[q] * values[k] / around.total[n]
                    for c in range(d):
                        r[c] = x[q, c] - around.centre[n, c]
                        forces[q, c] -= share * pull[n, c]
                    _add_turning(forces, q, share, turn, n, r, d)

    return Passes(near, filled, left, pushes, summed, surroundings, react)
