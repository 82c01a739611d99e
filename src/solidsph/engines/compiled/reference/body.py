"""ReferenceBody: one body whose sums are taken in the reference configuration, made ready."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, final

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.pointwise import no_law
from solidsph.engines.compiled.reference.blocks import STRIDE, group
from solidsph.engines.compiled.reference.chunks import weighted_chunks
from solidsph.engines.compiled.reference.partition import (
    Partition,
    Passes,
    aligned,
    partitioned,
    passes,
    spread_pass,
    thread_count,
)
from solidsph.engines.compiled.reference.rows import (
    Rows,
    compressed,
    in_chunks,
)
from solidsph.interfaces.body import Body
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs


@final
@attrs.frozen(eq=False)
class ReferenceBody:
    """One body made ready: weights, work space, and the passes over them."""

    body: Body
    law: Any  # compiled (H, params) -> T
    gradient: Rows
    force: Rows  # those that are scattered with; the gradient's own for the adjoint divergence
    factors: NDArray[Any]  # (n,) what multiplies the stress before it is scattered
    gradient_partition: Partition
    force_partition: Partition
    u: NDArray[Any]  # flat
    passes: Passes
    gradients: Passes  # without a law
    spread_pass: Any
    pair_count: int

    @property
    def precision(self) -> float:
        """As of all forces."""
        return float(np.finfo(self.u.dtype).eps)

    @property
    def bytes(self) -> int:
        """Memory of all arrays."""
        rows = {id(one): one.bytes for one in (self.gradient, self.force)}
        shares = {
            id(one): one.buffers.nbytes for one in (self.gradient_partition, self.force_partition)
        }
        own = self.factors.nbytes + self.u.nbytes
        return own + sum(rows.values()) + sum(shares.values())

    @property
    def operations(self) -> Sequence[Operations]:
        """What an evaluation passes over: runs by stencils, the rest by rows."""
        n, d = self.body.particles.positions.shape
        # Gathering and scattering are one pass each; a pair counts once for the two together.
        both = (self.gradient, self.force)
        run_pairs = sum(one.run_pairs for one in both) // 2
        row_pairs = sum(one.row_pairs for one in both) // 2
        ran = sum(one.run_particles for one in both) // 2
        row_bytes = sum({id(one): one.row_bytes for one in both}.values())
        shared_bytes = sum({id(one): one.bytes for one in both}.values()) - row_bytes
        # How many buffers there are depends on the threads of the machine; one is touched at least.
        touched = shared_bytes + self.factors.nbytes + 2 * self.u.nbytes + vectors(n, d)
        held = self.bytes - row_bytes
        precision, threaded = self.u.itemsize, self.gradient_partition.threaded
        return (
            Operations(SumMethod.STENCILS, run_pairs, ran, touched, held, precision, threaded),
            Operations(
                SumMethod.ROWS, row_pairs, n - ran, row_bytes, row_bytes, precision, threaded
            ),
        )

    @property
    def fused(self) -> bool:
        """Whether gathering and scattering go together where no condition comes between them."""
        return self.force is self.gradient and not self._ghosts_act

    @property
    def _ghosts_act(self) -> bool:
        uses = self.body.formulation.divergence.uses_ghost_stress
        return uses and bool(self.body.particles.ghosts.any())

    def forces(self, displacements: Array, out: Array) -> None:
        """Forces (n, d) of a fused body from displacements (n, d)."""
        shares = self.gradient_partition
        shares.check()
        self.passes.forces(
            shares.table,
            self.gradient,
            displacements,
            self.u,
            self.body.material.params,
            self.factors,
            shares.buffers,
            out,
        )

    def stress(self, displacements: Array, out: Array) -> None:
        """Stress (d, d, n) from displacements (n, d); ghosts have none."""
        self._stress(self.passes, displacements, out)
        out[:, :, self.body.particles.ghosts] = 0.0

    def gradient_of(self, displacements: Array, out: Array) -> None:
        """Gradient H (n, d, d) of displacements (n, d); that of ghosts is left as it is."""
        self._stress(self.gradients, displacements, out.transpose(1, 2, 0))

    def _stress(self, passes: Passes, displacements: Array, out: Array) -> None:
        self.gradient_partition.check()
        passes.stress(
            self.gradient_partition.table,
            self.gradient,
            displacements,
            self.u,
            self.body.material.params,
            out,
        )

    def spread(self, stress: Array, out: Array) -> None:
        """Forces (n, d) from stress (d, d, n)."""
        ghosts = self.body.particles.ghosts
        acts = self.body.formulation.divergence.uses_ghost_stress
        if not acts:
            stress[:, :, ghosts] = 0.0
        shares = self.force_partition
        self.spread_pass(shares.table, self.force, stress, self.factors, shares.buffers, out)
        if acts:
            # Ghosts have acted through their stress; nothing acts on them.
            out[ghosts] = 0.0


def reference_body(body: Body, law: Any, dtype: str) -> ReferenceBody:
    particles, divergence = body.particles, body.formulation.divergence
    n, d = particles.count, particles.dimension
    shortest_run = max(2, group(d, dtype) // 2)
    count = 0

    def counted(chunks: Iterator[tuple[Pairs, Array]]) -> Iterator[tuple[Pairs, Array]]:
        nonlocal count
        for pairs, weights in chunks:
            count += pairs.count
            yield pairs, weights

    if divergence.adjoint:
        # Ghosts have no stress of the law, so their rows are wanted only to act through.
        wanted = np.ones(n, dtype=np.bool_) if divergence.uses_ghost_stress else ~particles.ghosts
        chunks = counted(weighted_chunks(body, wanted))
        gradient = force = compressed(chunks, d, dtype, shortest_run)
        factors = np.where(wanted, -particles.volumes, 0.0)
    else:
        pairs = body.pairs()
        weights = body.formulation.gradient.weights(
            pairs, body.smoothing.gradient(pairs.offsets, pairs.distances), particles.cells
        )
        gradient = compressed(counted(in_chunks(pairs, weights)), d, dtype, shortest_run)
        # To gather with d_pq is to scatter with d_qp.
        weights = divergence.weights(pairs, weights, particles.volumes)[pairs.reversed_order()]
        force = compressed(in_chunks(pairs, weights), d, dtype, shortest_run)
        factors = np.ones(n)
    threads = thread_count(count)
    gradient_partition = partitioned(gradient, d, dtype, threads)
    force_partition = (
        gradient_partition if divergence.adjoint else partitioned(force, d, dtype, threads)
    )
    return ReferenceBody(
        body=body,
        law=law,
        gradient=gradient,
        force=force,
        factors=factors.astype(dtype),
        gradient_partition=gradient_partition,
        force_partition=force_partition,
        # Loops over runs read beyond the last particle by up to a group.
        u=aligned((n + group(d, dtype)) * STRIDE[d], dtype),
        passes=passes(d, dtype, law, threads > 1),
        gradients=passes(d, dtype, no_law, threads > 1),
        spread_pass=spread_pass(d, dtype, threads > 1),
        pair_count=count,
    )
