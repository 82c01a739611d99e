"""Contact forces between two bodies, or between parts of one."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.effects._contact_passes import Passes, Surroundings, passes
from solidsph_builtin.effects._crowding import REACH
from solidsph_builtin.effects._room import Excess, Near, Room
from solidsph_builtin.effects._search import Candidates, NeighbourList, Search, candidates, together
from solidsph_builtin.effects._slip import slid

# Relative to the squared reach: moments of inertia below this are those of particles on a line.
_SLENDER = 1e-6


@attrs.frozen(eq=False)
class Touch:
    """Pairs within reach, and the excess of the volume fraction at every particle."""

    near: Near
    beyond: Excess

    @property
    def excess(self) -> Array:
        """o of every particle, (m,) [-]."""
        return self.beyond.excess


@attrs.frozen(eq=False)
class Rubbing:
    """Particles that friction holds to the other body."""

    around: Surroundings
    places: Indices  # (k,) in `around`
    own: Indices  # (k,) their numbers
    relative: Array  # (k, d) their velocity relative to the other body [m/s]
    normals: Array  # (k, d)
    limits: Array  # (k,) largest friction [N]
    rise: Array  # (k,) its derivative by the excess [N]


@attrs.frozen(eq=False)
class Meeting:
    """Two bodies that may touch; particles of the first are numbered before those of the second."""

    first: str  # name of a body
    second: str  # the other's, or the same
    particles: Indices  # (m,) among all particles
    belongs: Mask  # (m,) True for those of the first body
    volumes: Array  # (m,) V [m^d]
    depths: Array  # (m,) below the surface of their body [m]
    room: Room
    modulus: Array  # (m,) K [Pa]
    spring: Array  # (m,) of friction [N/m]
    frequency: float  # the contact adds at most this angular frequency [rad/s]
    kernel: SmoothingKernel  # with the largest reach
    search: Search
    # A cache, which does not influence results.
    _near: NeighbourList = attrs.field(init=False, repr=False)

    @_near.default
    def _no_list(self) -> NeighbourList:
        return NeighbourList(self.search, self.room.brought)

    places: slice | Indices = attrs.field(init=False, repr=False)  # the particles

    @places.default
    def _as_a_slice(self) -> slice | Indices:
        return together(self.particles)

    @property
    def _passes(self) -> Passes:
        return passes(self.kernel.kernel, self.kernel.dimension)

    @property
    def name(self) -> str:
        """Names of the bodies."""
        return self.first if self.first == self.second else f"{self.first} and {self.second}"

    def touch(self, positions: Array) -> Touch | None:
        """Pairs at `positions` (n, d) of all particles [m]; None while the boxes are apart."""
        if self.search.far_apart(positions):
            return None
        x = positions[self.places]
        near = self._within_reach(x, self._near.candidates(x))
        return Touch(near, self.room.excess(self._passes, self.volumes, near))

    def _within_reach(self, x: Array, found: Candidates) -> Near:
        kernel = self.kernel
        of_kernel = kernel.normalisation, kernel.kernel.params
        lists = found.i, found.j, found.reaches
        places, i, j, offsets, values, slopes = self._passes.near(x, *lists, *of_kernel)
        return Near(i, j, offsets, values, slopes, found, places)

    def unloaded(self, X: Array) -> Meeting:
        """The meeting without forces at the reference positions X (m, d) of its particles [m].

        Bodies are apart there by definition, so room is at least the volume fraction of the other.
        Faces that lie on each other initially then touch to rounding, also with scattered particles
        and in corners of the other, which fill more than a plane face does.
        """
        near = self._within_reach(X, candidates(self.search, self.room.brought, X))
        return attrs.evolve(self, room=self.room.at_least(self._passes, self.volumes, near))

    def pushes(self, touch: Touch) -> Array:
        """Force on i of every pair along the line between the two, (k, d) [N]; opposite on j."""
        near, beyond = touch.near, touch.beyond
        pressures = self.modulus * beyond.excess
        of_pairs = near.i, near.j, near.offsets, *beyond.slopes
        found: Array = self._passes.pushes(*of_pairs, self.volumes, pressures)
        return found

    def normal_forces(self, touch: Touch) -> Array:
        """Normal force on every particle, (m, d) [N]: minus the derivative of the energies."""
        pushes = self.pushes(touch)
        forces: Array = self._passes.summed(touch.near.i, touch.near.j, pushes, len(self.volumes))
        return forces

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
        forces, slipped = np.zeros_like(x), np.zeros_like(x)
        if not touch.excess.any():
            return forces, slipped
        rub = self.rubbing(touch, x, v, friction)
        own = rub.own
        slipped[own] = slid(
            slip[own], rub.relative, rub.normals, step, self.spring[own], rub.limits
        )
        pull = np.zeros_like(rub.around.slope)
        pull[rub.places] = forces[own] = -self.spring[own][:, None] * slipped[own]
        of_pairs = touch.near.i, touch.near.j, touch.near.values
        self._passes.react(rub.around, *of_pairs, self.volumes, x, forces, pull)
        return forces, slipped

    def rubbing(self, touch: Touch, x: Array, v: Array, friction: float) -> Rubbing:
        """The particles with a spring at positions x (m, d) [m] and velocities v (m, d) [m/s]."""
        V, K, near = self.volumes, self.modulus, touch.near
        of_pairs = near.i, near.j, near.offsets, near.values, *touch.beyond.slopes
        floors = _SLENDER * self.search.radii**2
        around = self._passes.surroundings(*of_pairs, V, touch.excess, x, v, floors)
        steep = np.linalg.norm(around.slope, axis=1)
        k = np.flatnonzero((steep > 0.0) & around.sound)
        own = around.own[k]
        return Rubbing(
            around=around,
            places=k,
            own=own,
            relative=v[own] - around.velocity[k],
            normals=around.slope[k] / steep[k][:, None],
            limits=friction * K[own] * V[own] * touch.excess[own] * steep[k],
            rise=friction * K[own] * V[own] * steep[k],
        )

    def least_gap(self, positions: Array) -> float:
        """Distance of the surfaces of two bodies [m], by their nearest outermost particles."""
        x = positions[self.particles]
        outer = self.depths <= self.search.radii / REACH
        one, other = np.flatnonzero(outer & self.belongs), np.flatnonzero(outer & ~self.belongs)
        distances, nearest = cKDTree(x[other]).query(x[one])
        gaps = distances - self.depths[one] - self.depths[other[nearest]]
        return float(gaps.min())
