"""A body whose neighbours, kernel, volumes and weights are found anew at every step, compiled."""

from __future__ import annotations

from typing import Any, final

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.engines.compiled.cells import Neighbours, NeighbourSearch
from solidsph.engines.compiled.kernels import KernelPass, kernel_pass
from solidsph.engines.compiled.operators import (
    force_loop,
    kernel_sums,
    stress_loop,
    weighted_forces,
    weights_loop,
)
from solidsph.engines.compiled.pointwise import no_law


@attrs.frozen(eq=False)
class _Weights:
    """What one set of displacements gives."""

    neighbours: Neighbours
    positions: Array  # (n, d) [m]
    volumes: Array  # (n,) that particles have now [m^d]
    gradient: Array  # (m, d) [1/m]


@final
@attrs.define(eq=False)
class MovingBody:
    """One body made ready: the loops over its pairs, and the arrays that they fill.

    Nothing that is kept between two evaluations has an influence on their results. Unlike sums in
    the reference configuration, which are of differences, these are in double precision always.
    """

    body: Body
    law: Any  # compiled (H, params) -> T
    search: NeighbourSearch
    kernel: KernelPass
    pair_count: int = attrs.field(init=False)
    reference_sums: Array = attrs.field(init=False)  # (n,) of the kernel, as in the matrix engine
    tensors: Array = attrs.field(init=False)  # (n, d, d) the stress that acts [Pa]
    weights: _Weights | None = attrs.field(init=False, default=None)
    _pairs: tuple[Array, Array, Array] = attrs.field(init=False)  # W, W'(r) / r, g of all pairs

    def __attrs_post_init__(self) -> None:
        particles = self.body.particles
        n, d = particles.count, particles.dimension
        self.tensors = np.zeros((n, d, d))
        self._pairs = np.empty(0), np.empty(0), np.empty((0, d))
        neighbours, _, self.reference_sums = self._crowding(particles.positions)
        self.pair_count = neighbours.count

    @property
    def fused(self) -> bool:
        """Whether both passes are one call where no condition comes between them."""
        return True

    @property
    def bytes(self) -> int:
        """Memory of all arrays."""
        own = self.reference_sums.nbytes + self.tensors.nbytes
        return own + self.search.bytes + sum(array.nbytes for array in self._pairs)

    def forces(self, displacements: Array, out: Array) -> None:
        """Forces (n, d) from displacements (n, d) where no condition changes the stress."""
        weights = self._form(displacements)
        self._stress(weights, self.law, displacements, self.tensors)
        self.tensors[self.body.particles.ghosts] = 0.0
        self._spread(weights, out)

    def stress(self, displacements: Array, out: Array) -> None:
        """Stress (d, d, n) from displacements (n, d); ghosts have none."""
        self.weights = self._form(displacements)
        self._stress(self.weights, self.law, displacements, self.tensors)
        self.tensors[self.body.particles.ghosts] = 0.0
        out[...] = np.moveaxis(self.tensors, 0, -1)

    def spread(self, stress: Array, out: Array) -> None:
        """Forces (n, d) from stress (d, d, n), at the displacements it was found from."""
        self.tensors[...] = np.moveaxis(stress, -1, 0)
        if not self.body.formulation.divergence.uses_ghost_stress:
            self.tensors[self.body.particles.ghosts] = 0.0
        assert self.weights is not None, "stress comes first"
        self._spread(self.weights, out)

    def gradient_of(self, displacements: Array) -> Array:
        """Gradient H (d, d, n) of displacements (n, d); that of ghosts is 0."""
        H = np.empty_like(self.tensors)
        self._stress(self._form(displacements), no_law, displacements, H)
        H[self.body.particles.ghosts] = 0.0
        return np.moveaxis(H, 0, -1)

    def _form(self, displacements: Array) -> _Weights:
        """Everything that depends on where the particles are."""
        particles, formulation = self.body.particles, self.body.formulation
        positions = particles.positions + displacements
        neighbours, slopes, sums = self._crowding(positions)
        # As in the matrix engine, the volume follows the crowding relative to the reference.
        with np.errstate(all="ignore"):
            crowding = self.reference_sums / sums
        cells, volumes = particles.cells * crowding, particles.volumes * crowding
        gradient = self._pairs[2]
        loop = weights_loop(formulation.gradient, particles.dimension)
        if loop is None or not loop(neighbours, positions, slopes, cells, gradient):
            # The array form says in its own words what a loop cannot make.
            pairs = neighbours.pairs(positions)
            kernel_gradients = -slopes[: pairs.count, None] * pairs.offsets
            gradient = formulation.gradient.weights(pairs, kernel_gradients, cells)
        return _Weights(neighbours, positions, volumes, gradient)

    def _crowding(self, positions: Array) -> tuple[Neighbours, Array, Array]:
        """Neighbours, W'(r) / r of their pairs, and the kernel's sums, (n,)."""
        particles = self.body.particles
        neighbours = self.search.neighbours(positions)
        room = len(neighbours.columns)
        if len(self._pairs[0]) != room:
            self._pairs = np.empty(room), np.empty(room), np.empty((room, particles.dimension))
        values, slopes, _ = self._pairs
        self.kernel(neighbours, values, slopes)
        sums = np.empty(particles.count)
        kernel_sums(neighbours, values, particles.cells, sums)
        return neighbours, slopes, sums

    def _stress(self, weights: _Weights, law: Any, displacements: Array, out: Array) -> None:
        loop = stress_loop(self.body.particles.dimension, law)
        params = self.body.material.params
        loop(weights.neighbours, weights.gradient, displacements, params, out)

    def _spread(self, weights: _Weights, out: Array) -> None:
        divergence, d = self.body.formulation.divergence, self.body.particles.dimension
        loop = force_loop(divergence, d)
        if loop is not None:
            loop(weights.neighbours, weights.gradient, weights.volumes, self.tensors, out)
        else:
            pairs = weights.neighbours.pairs(weights.positions)
            own = divergence.weights(pairs, weights.gradient[: pairs.count], weights.volumes)
            weighted_forces(d)(weights.neighbours, own, self.tensors, out)
        if divergence.uses_ghost_stress:
            # Ghosts have acted through their stress; nothing acts on them.
            out[self.body.particles.ghosts] = 0.0


def moving_body(body: Body, law: Any) -> MovingBody:
    """A body made ready, with its compiled law (H, params) -> T."""
    search = NeighbourSearch(body.smoothing.support_radius)
    return MovingBody(body, law, search, kernel_pass(body.smoothing))
