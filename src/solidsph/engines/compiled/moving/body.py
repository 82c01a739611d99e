"""A body whose neighbours, kernel, volumes and weights are found anew at every step, compiled."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from typing import Any, ClassVar, final

import attrs
import numpy as np
from numba import njit

from solidsph.engines.compiled.moving.kernel_pass import KernelPass, kernel_pass
from solidsph.engines.compiled.moving.neighbourhoods import Neighbourhoods, fill, kernel_sums
from solidsph.engines.compiled.moving.pointwise_sums import PointwiseSums
from solidsph.engines.compiled.moving.search import NeighbourSearch
from solidsph.engines.compiled.moving.weighted_sums import WeightedSums
from solidsph.engines.compiled.pointwise import NotCompilableError
from solidsph.engines.compiled.vectors import MATRIX
from solidsph.interfaces.body import Body
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class _Place:
    """What the positions of a step determine."""

    positions: Array  # (n, d) x [m]
    cells: Array  # (n,) weights in sums over neighbours now [m^d]
    volumes: Array  # (n,) [m^d]


@final
@attrs.define(eq=False)
class MovingBody:
    """One body made ready: the loops over its pairs, and the arrays that they fill.

    What is kept between evaluations has no influence on their results. These sums are in double
    precision always: they are of positions, not of displacements alone.
    """

    body: Body
    law: Any  # compiled (tensors (n, d, d), params): T in place of H
    search: NeighbourSearch
    kernel: KernelPass
    sums: PointwiseSums | WeightedSums
    pair_count: int = attrs.field(init=False)
    reference_sums: Array = attrs.field(init=False)  # (n,) of the kernel, as in the matrix engine
    tensors: Array = attrs.field(init=False)  # (n, d, d) H, or the stress that acts
    _own_value: float = attrs.field(init=False)  # W(0) [m^-d]
    _rows: Neighbourhoods = attrs.field(init=False)
    _values: Array = attrs.field(init=False)  # (k,) W of near pairs
    _slopes: Array = attrs.field(init=False)  # (k,) W'(r) / r of near pairs
    _place: _Place | None = attrs.field(init=False, default=None)

    precision: ClassVar[float] = sys.float_info.epsilon

    def __attrs_post_init__(self) -> None:
        particles = self.body.particles
        self.tensors = np.empty((particles.count, particles.dimension, particles.dimension))
        self._values = self._slopes = np.empty(0)
        self._own_value = float(self.body.smoothing.value(np.zeros(1))[0])
        self.reference_sums = self._found(particles.positions)
        self.pair_count = self._rows.pair_count

    @property
    def fused(self) -> bool:
        """Whether both passes are one call where no condition comes between them."""
        return True

    @property
    def bytes(self) -> int:
        """Memory of the arrays kept between evaluations."""
        own = (self.reference_sums, self.tensors, self._values, self._slopes, *self._rows)
        return self.search.bytes + sum(array.nbytes for array in own)

    @property
    def operations(self) -> Sequence[Operations]:
        """What an evaluation passes over, with the neighbours of the start."""
        n, d = self.body.particles.positions.shape
        way = SumMethod.FORMULAS if isinstance(self.sums, PointwiseSums) else SumMethod.WEIGHTS
        return (Operations(way, self.pair_count, n, self.bytes + vectors(n, d), self.bytes),)

    def forces(self, displacements: Array, out: Array) -> None:
        """Forces (n, d) from displacements (n, d) where no condition changes the stress."""
        self._stress(displacements)
        self._spread(out)

    def stress(self, displacements: Array, out: Array) -> None:
        """Stress (d, d, n) from displacements (n, d); ghosts have none."""
        self._stress(displacements)
        out[...] = np.moveaxis(self.tensors, 0, -1)

    def spread(self, stress: Array, out: Array) -> None:
        """Forces (n, d) from stress (d, d, n), at the displacements that `stress` had last."""
        self.tensors[...] = np.moveaxis(stress, -1, 0)
        if not self.body.formulation.divergence.uses_ghost_stress:
            self.tensors[self.body.particles.ghosts] = 0.0
        self._spread(out)

    def gradient_of(self, displacements: Array, out: Array) -> None:
        """Gradient H (n, d, d) of displacements (n, d); that of ghosts is of no use."""
        self._gradients(displacements)
        out[...] = self.tensors

    def _stress(self, displacements: Array) -> None:
        self._gradients(displacements)
        self.law(self.tensors, self.body.material.params)
        self.tensors[self.body.particles.ghosts] = 0.0

    def _gradients(self, displacements: Array) -> None:
        particles = self.body.particles
        positions = particles.positions + displacements
        sums = self._found(positions)
        # As in the matrix engine, the volume follows the crowding relative to the reference.
        with np.errstate(all="ignore"):
            crowding = self.reference_sums / sums
        place = _Place(positions, particles.cells * crowding, particles.volumes * crowding)
        self._place = place
        self.sums.gradients(self._rows, positions, place.cells, displacements, self.tensors)

    def _spread(self, out: Array) -> None:
        place = self._place
        assert place is not None, "stress comes first"
        self.sums.forces(self._rows, place.positions, place.cells, place.volumes, self.tensors, out)
        if self.body.formulation.divergence.uses_ghost_stress:
            # Ghosts have acted through their stress; nothing acts on them.
            out[self.body.particles.ghosts] = 0.0

    def _found(self, positions: Array) -> Array:
        """The kernel's sums at `positions`, (n,), once the rows are filled."""
        particles = self.body.particles
        near = self.search.near(positions)
        room = len(near.columns)
        if len(self._values) != room:
            self._values, self._slopes = np.empty(room), np.empty(room)
            self._rows = Neighbourhoods.with_room(particles.count, room)
        self.kernel(near, self._values, self._slopes)
        fill(near, self._slopes, self._rows)
        sums = np.empty(particles.count)
        kernel_sums(near, self._values, self._own_value, particles.cells, sums)
        return sums


def moving_body(body: Body, law: Any) -> MovingBody:
    """A body made ready, with its compiled law (H, params) -> T."""
    try:
        sums: PointwiseSums | WeightedSums = PointwiseSums.of(body)
    except NotCompilableError:
        sums = WeightedSums(body.formulation)
    return MovingBody(
        body=body,
        law=_law_loop(body.particles.dimension, law),
        search=NeighbourSearch(body.smoothing.support_radius, body.hidden),
        kernel=kernel_pass(body.smoothing),
        sums=sums,
    )


@cache
def _law_loop(dimension: int, law: Any) -> Any:
    matrix = MATRIX[dimension]

    @njit(error_model="numpy")
    def loop(tensors, params):
        for p in range(len(tensors)):
            T = law(matrix(tensors, p), params)
            for i in range(dimension):
                for k in range(dimension):
                    tensors[p, i, k] = T[i][k]

    return loop
