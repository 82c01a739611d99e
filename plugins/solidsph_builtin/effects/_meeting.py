"""Contact forces between two bodies, or between parts of one."""

from __future__ import annotations

from math import prod

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.effects._crowding import REACH
from solidsph_builtin.effects._search import NeighbourList, Search
from solidsph_builtin.effects._slip import slid

# Relative to the squared reach: moments of inertia below this are those of particles on a line.
_SLENDER = 1e-6

# Bound on the relative rounding of sums of the same terms, in another order or after a translation.
_ROUNDING = 1e-9


@attrs.frozen(eq=False)
class Touch:
    """Pairs within reach, and the excess of the volume fraction at every particle."""

    i: Indices  # (k,)
    j: Indices  # (k,)
    offsets: Array  # (k, d) x_i - x_j [m]
    values: Array  # (k,) W [m^-d]
    slopes: Array  # (k,) dW/dr / r [m^-(d+2)]
    excess: Array  # (m,) o, volume fraction of the other body beyond the room [-]


@attrs.frozen(eq=False)
class Meeting:
    """Two bodies that may touch; particles of the first are numbered before those of the second."""

    first: str  # name of a body
    second: str  # the other's, or the same
    particles: Indices  # (m,) among all particles
    belongs: Mask  # (m,) True for those of the first body
    volumes: Array  # (m,) V [m^d]
    room: Array  # (m,) volume fraction that the other may fill around them [-]
    depths: Array  # (m,) below the surface of their body [m]
    modulus: float  # K [Pa]
    spring: Array  # (m,) of friction [N/m]
    kernel: SmoothingKernel
    search: Search
    # A cache, which does not influence results.
    _near: NeighbourList = attrs.field(init=False, repr=False)

    @_near.default
    def _no_list(self) -> NeighbourList:
        return NeighbourList(self.search, self.kernel.support_radius)

    @property
    def name(self) -> str:
        """Names of the bodies."""
        return self.first if self.first == self.second else f"{self.first} and {self.second}"

    def touch(self, positions: Array) -> Touch | None:
        """Pairs at `positions` (n, d) of all particles [m]; None while the boxes are apart."""
        if self.search.far_apart(positions):
            return None
        x = positions[self.particles]
        i, j = self._near.pairs(x)
        offsets = x[i] - x[j]
        distances = np.sqrt(np.sum(offsets**2, axis=1))
        values = self.kernel.value(distances)
        return Touch(
            i,
            j,
            offsets,
            values,
            self.kernel.slope_by_distance(distances),
            np.maximum(self._filled(i, j, values) - self.room, 0.0),
        )

    def unloaded(self, X: Array) -> Meeting:
        """The meeting without forces at the reference positions X (m, d) of its particles [m].

        Bodies are apart there by definition, so room is at least the volume fraction of the other.
        Faces that lie on each other initially then touch to rounding, also with scattered particles
        and in corners of the other, which fill more than a plane face does.
        """
        i, j = self.search.within(X, self.kernel.support_radius)
        values = self.kernel.value(np.linalg.norm(X[i] - X[j], axis=1))
        filled = (1.0 + _ROUNDING) * self._filled(i, j, values)
        return attrs.evolve(self, room=np.maximum(self.room, filled))

    def _filled(self, i: Indices, j: Indices, values: Array) -> Array:
        """Volume fraction of the other body around every particle, (m,) [-], by W of pairs."""
        filled = self._summed_here(i, values * self.volumes[j])
        return filled + self._summed_here(j, values * self.volumes[i])

    def pushes(self, touch: Touch) -> Array:
        """Force on i of every pair along the line between the two, (k, d) [N]; opposite on j."""
        i, j = touch.i, touch.j
        both = touch.excess[i] + touch.excess[j]
        pull = self.modulus * self.volumes[i] * self.volumes[j] * both
        return np.asarray(-(pull * touch.slopes)[:, None] * touch.offsets)

    def normal_forces(self, touch: Touch) -> Array:
        """Normal force on every particle, (m, d) [N]: minus the derivative of the energies."""
        pushes = self.pushes(touch)
        return self._summed_here(touch.i, pushes) - self._summed_here(touch.j, pushes)

    def energies(self, touch: Touch) -> Array:
        """Energy K V o^2 / 2 of every particle, (m,) [J]."""
        return np.asarray(0.5 * self.modulus * self.volumes * touch.excess**2)

    def rubbed(
        self, touch: Touch, x: Array, v: Array, slip: Array, step: float, friction: float
    ) -> tuple[Array, Array]:
        """Friction on every particle, (m, d) [N], and the stretch of its spring, (m, d) [m].

        A particle with an excess is tied by a spring to the other body, which moves there like a
        rigid body with the linear and angular momentum of its particles nearby, weighted by their
        contribution to the volume fraction. The spring acts on them as a force and a moment with
        the same weights, so that all momenta are conserved and the power is that of the spring.
        """
        m, d = x.shape
        forces, slipped = np.zeros((m, d)), np.zeros((m, d))
        # Both directions: particle p with an excess, renumbered, beside particle q of the other
        # body.
        active = np.flatnonzero(touch.excess > 0.0)
        count = len(active)
        if not count:
            return forces, slipped
        number = np.full(m, -1, dtype=np.intp)
        number[active] = np.arange(count)
        p = number[np.concatenate([touch.i, touch.j])]
        chosen = np.flatnonzero(p >= 0)
        p, q = p[chosen], np.concatenate([touch.j, touch.i])[chosen]
        pair = chosen % len(touch.i)
        sign = np.where(chosen < len(touch.i), 1.0, -1.0)
        fills = self.volumes[q]
        slope = (fills * touch.slopes[pair] * sign)[:, None] * touch.offsets[pair]
        inward = _summed(p, slope, count)  # gradient of the volume fraction
        shares = fills * touch.values[pair]
        shares /= np.bincount(p, shares, count)[p]
        centre = _summed(p, shares[:, None] * x[q], count)
        mean = _summed(p, shares[:, None] * v[q], count)
        arms = x[q] - centre[p]
        inertia = _summed(p, shares[:, None, None] * _inertia(arms), count)
        spin = _summed(p, shares[:, None] * _cross(arms, v[q] - mean[p]), count)
        steep = np.linalg.norm(inward, axis=1)
        floor = _SLENDER * self.kernel.support_radius**2
        k = np.flatnonzero((steep > 0.0) & (np.linalg.eigvalsh(inertia)[:, 0] > floor))
        own = active[k]
        reach = x[own] - centre[k]
        rate = np.linalg.solve(inertia[k], spin[k][..., None])[..., 0]
        there = mean[k] + _turning(np.asarray(rate, dtype=np.float64), reach)
        limits = friction * self.modulus * self.volumes[own] * touch.excess[own] * steep[k]
        normals = inward[k] / steep[k][:, None]
        slipped[own] = slid(slip[own], v[own] - there, normals, step, self.spring[own], limits)
        pull = -self.spring[own][:, None] * slipped[own]
        forces[own] = pull
        turn = np.zeros((count, inertia.shape[1]))
        turn[k] = np.linalg.solve(inertia[k], -_cross(reach, pull)[..., None])[..., 0]
        back = np.zeros((count, d))
        back[k] = -pull
        forces += _summed(q, shares[:, None] * (back[p] + _turning(turn[p], arms)), m)
        return forces, slipped

    def least_gap(self, positions: Array) -> float:
        """Distance of the surfaces of two bodies [m], by their nearest outermost particles."""
        x = positions[self.particles]
        outer = self.depths <= self.kernel.support_radius / REACH
        one, other = np.flatnonzero(outer & self.belongs), np.flatnonzero(outer & ~self.belongs)
        distances, nearest = cKDTree(x[other]).query(x[one])
        gaps = distances - self.depths[one] - self.depths[other[nearest]]
        return float(gaps.min())

    def _summed_here(self, rows: Indices, values: Array) -> Array:
        return _summed(rows, values, len(self.particles))


def _summed(rows: Indices, values: Array, count: int) -> Array:
    """Sum of `values` (k, ...) by their rows, (count, ...), in the order of the pairs."""
    shape = values.shape[1:]
    columns = values.reshape(len(values), prod(shape))
    sums = np.empty((count, columns.shape[1]))
    for k, column in enumerate(columns.T):
        sums[:, k] = np.bincount(rows, column, count)
    return sums.reshape(count, *shape)


def _cross(a: Array, b: Array) -> Array:
    """a x b of vectors (k, d): (k, 3), in the plane (k, 1)."""
    if a.shape[1] == 2:
        return np.asarray(a[:, :1] * b[:, 1:] - a[:, 1:] * b[:, :1])
    return np.cross(a, b)


def _turning(w: Array, r: Array) -> Array:
    """w x r with w (k, 3), in the plane (k, 1), and r (k, d): (k, d)."""
    if r.shape[1] == 2:
        return np.column_stack([-w[:, 0] * r[:, 1], w[:, 0] * r[:, 0]])
    return np.cross(w, r)


def _inertia(r: Array) -> Array:
    """|r|^2 I - r r^T of vectors (k, d): (k, 3, 3), in the plane (k, 1, 1)."""
    squares = np.sum(r**2, axis=1)[:, None, None]
    if r.shape[1] == 2:
        return np.asarray(squares)
    return np.asarray(squares * np.eye(3) - r[:, :, None] * r[:, None, :])
