"""ReferenceBody: a body whose sums are taken in the reference configuration, prepared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, final

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.filter_operations import filter_operations
from solidsph.engines.compiled.fixed.block_law import block_law
from solidsph.engines.compiled.fixed.blocks import group
from solidsph.engines.compiled.fixed.chunks import in_chunks, weighted_chunks
from solidsph.engines.compiled.fixed.own_stiffness import own_stiffness_pass
from solidsph.engines.compiled.fixed.partition import (
    Partition,
    flat_field,
    force_pass,
    padded,
    partitioned,
    spread_pass,
    stress_pass,
    thread_count,
)
from solidsph.engines.compiled.fixed.replaced_rows import replaced_rows
from solidsph.engines.compiled.fixed.rows import Rows, compressed
from solidsph.engines.compiled.fixed.subset_rows import part_of_rows
from solidsph.engines.compiled.history_law import history_count, stepping_law, without_history
from solidsph.engines.compiled.pointwise import no_law
from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.interfaces.row_weights import RowWeights
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs


@final
@attrs.frozen(eq=False)
class ReferenceBody:
    """Weights, work space, and the compiled passes over them."""

    body: Body
    law: Any  # compiled (H, params) -> T
    gradient: Rows
    force: Rows  # rows to scatter with; those of the gradient if the divergence is adjoint
    factors: NDArray[Any]  # (n,) multiply the stress before it is scattered
    pair_count: int
    gradient_partition: Partition
    force_partition: Partition
    u: NDArray[Any]  # flat
    stress_pass: Any
    gradient_pass: Any  # the same without a law
    spread_pass: Any

    @classmethod
    def of(
        cls, body: Body, law: Any, gradient: Rows, force: Rows, factors: Array, pair_count: int
    ) -> ReferenceBody:
        """The body with these rows, in the number type of their weights."""
        dtype = gradient.row_weights.dtype.name
        n, d = body.particles.positions.shape
        threads = thread_count(pair_count)
        own = partitioned(gradient, d, dtype, threads)
        return cls(
            body=body,
            law=law,
            gradient=gradient,
            force=force,
            factors=padded(factors, dtype),
            pair_count=pair_count,
            gradient_partition=own,
            force_partition=own if force is gradient else partitioned(force, d, dtype, threads),
            u=flat_field(n, d, dtype),
            stress_pass=stress_pass(d, dtype, law, threads > 1),
            gradient_pass=stress_pass(d, dtype, no_law, threads > 1),
            spread_pass=spread_pass(d, dtype, threads > 1),
        )

    def part(self, chosen: Indices) -> ReferenceBody:
        """The chosen particles (k,) alone, renumbered in order."""
        rows = part_of_rows(self.gradient, chosen, self.body.particles.count)
        count = rows.run_pairs + rows.row_pairs
        return self.of(
            part_of(self.body, chosen), self.law, rows, rows, self.factors[chosen], count
        )

    def reweighted(self, changed: RowWeights) -> ReferenceBody:
        """A fused body with other weights at some particles."""
        rows = replaced_rows(self.gradient, changed, self.body.particles.count)
        count = rows.run_pairs + rows.row_pairs
        return self.of(self.body, self.law, rows, rows, self.factors, count)

    @property
    def precision(self) -> float:
        """Machine epsilon of the numbers that are summed."""
        return float(np.finfo(self.u.dtype).eps)

    @property
    def bytes(self) -> int:
        """Memory of all arrays [bytes]."""
        rows = {id(part): part.bytes for part in (self.gradient, self.force)}
        both = (self.gradient_partition, self.force_partition)
        buffers = {id(part): part.buffers.nbytes for part in both}
        own = self.factors.nbytes + self.u.nbytes
        return own + sum(rows.values()) + sum(buffers.values())

    @property
    def operations(self) -> Sequence[Operations]:
        """Operations of one evaluation: of runs by stencils, of the rest by rows."""
        n, d = self.body.particles.positions.shape
        # Gathering and scattering are one pass each; a pair counts once for the two together.
        both = (self.gradient, self.force)
        run_pairs = sum(part.run_pairs for part in both) // 2
        row_pairs = sum(part.row_pairs for part in both) // 2
        ran = sum(part.run_particles for part in both) // 2
        row_bytes = sum({id(part): part.row_bytes for part in both}.values())
        stencil_bytes = sum({id(part): part.bytes for part in both}.values()) - row_bytes
        # The number of buffers depends on the threads of the machine; at least one is touched.
        touched = stencil_bytes + self.factors.nbytes + 2 * self.u.nbytes + vectors(n, d)
        held = self.bytes - row_bytes
        kind = self.u.itemsize, self.gradient_partition.threaded
        sums = (
            Operations(SumMethod.STENCILS, run_pairs, ran, touched, held, *kind),
            Operations(SumMethod.ROWS, row_pairs, n - ran, row_bytes, row_bytes, *kind),
        )
        return sums if self.body.dilatation_filter is None else (*sums, self._filter_operations())

    def _filter_operations(self) -> Operations:
        n, d = self.body.particles.positions.shape
        assert self.body.dilatation_filter is not None
        entries = self.body.dilatation_filter.smooth_part.rows.nnz
        own = round(entries * (1.0 - self.gradient.run_particles / n))
        return filter_operations(n, entries, d, own, threaded=self.gradient_partition.threaded)

    @property
    def fused(self) -> bool:
        """True if both passes are one call where no term changes the stress between them."""
        return self.force is self.gradient and not self._ghosts_act

    @property
    def filters(self) -> bool:
        """True if it filters its dilatation, which the compiled loop does between both passes."""
        return self.body.dilatation_filter is not None

    @property
    def remembers(self) -> bool:
        """True if its material has internal variables."""
        return history_count(self.body) > 0

    @property
    def block_law(self) -> Any:
        """The compiled law over a block (`fixed/block_law.py`), internal variables included.

        Raises:
            NotCompilableError: the law does not compile.
        """
        return self._block_law(stepping_law(self.body, self.law), history_count(self.body))

    @property
    def force_pass(self) -> Any:
        """The compiled pass of `forces` that advances the internal variables.

        Raises:
            NotCompilableError: the law does not compile.
        """
        return self._force_pass(self.block_law)

    def history(self) -> Array:
        """New internal variables of all particles, (n, k); k is 0 for a material without."""
        return padded(np.zeros((self.body.particles.count, history_count(self.body))), "float64")

    def _block_law(self, law: Any, variables: int) -> Any:
        d, dtype = self.body.smoothing.dimension, self.u.dtype.name
        return block_law(d, dtype, law, variables, len(self.body.material.params))

    def _force_pass(self, law: Any) -> Any:
        d, dtype = self.body.smoothing.dimension, self.u.dtype.name
        return force_pass(d, dtype, law, self.gradient_partition.threaded)

    @property
    def _ghosts_act(self) -> bool:
        uses = self.body.formulation.divergence.uses_ghost_stress
        return uses and bool(self.body.particles.ghosts.any())

    def forces(self, displacements: Array, out: Array) -> None:
        """Forces (n, d) of a fused body from displacements (n, d)."""
        own = self.gradient_partition
        own.check()
        self._force_pass(self._block_law(without_history(self.law), 0))(
            own.table,
            self.gradient,
            displacements,
            self.u,
            self.body.material.params,
            self.factors,
            own.buffers,
            out,
            padded(np.zeros((len(out), 0)), "float64"),
            0.0,
        )

    def stress(self, displacements: Array, out: Array) -> None:
        """Stress (d, d, n) from displacements (n, d); ghosts have none."""
        self._stress(self.stress_pass, displacements, out)
        out[:, :, self.body.particles.ghosts] = 0.0

    def gradient_of(self, displacements: Array, out: Array) -> None:
        """Gradients H (n, d, d) of displacements (n, d); those of ghosts are not written."""
        self._stress(self.gradient_pass, displacements, out.transpose(1, 2, 0))

    def _stress(self, pass_over: Any, displacements: Array, out: Array) -> None:
        own = self.gradient_partition
        own.check()
        params = self.body.material.params
        pass_over(own.table, self.gradient, displacements, self.u, params, out)

    def spread(self, stress: Array, out: Array) -> None:
        """Forces (n, d) from stress (d, d, n)."""
        ghosts = self.body.particles.ghosts
        ghosts_act = self.body.formulation.divergence.uses_ghost_stress
        if not ghosts_act:
            stress[:, :, ghosts] = 0.0
        own = self.force_partition
        self.spread_pass(own.table, self.force, stress, self.factors, own.buffers, out)
        if ghosts_act:
            # Ghosts have acted through their stress; no force acts on them.
            out[ghosts] = 0.0

    def add_own_stiffness(self, moduli: Array, blocks: Array) -> None:
        """Add that of a fused body with moduli (n, d d, d d) to blocks (n, d, d)."""
        run = own_stiffness_pass(self.body.particles.dimension)
        run(self.gradient, self.factors, moduli, blocks)


def reference_body(body: Body, law: Any, dtype: str) -> ReferenceBody:
    """A body with its compiled law (H, params) -> T, prepared for sums in a number type.

    Raises:
        BuildError: a formulation's operators cannot be formed on these particles.
    """
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
        # Ghosts have no stress of the law, so their rows are needed only if they act.
        wanted = np.ones(n, dtype=np.bool_) if divergence.uses_ghost_stress else ~particles.ghosts
        chunks = counted(weighted_chunks(body, wanted))
        gradient = force = compressed(chunks, d, dtype, shortest_run)
        factors = np.where(wanted, -particles.volumes, 0.0)
    else:
        pairs = body.pairs()
        weights = body.formulation.gradient.weights(
            pairs, body.smoothing.gradients_of(pairs), particles.cells
        )
        gradient = compressed(counted(in_chunks(pairs, weights)), d, dtype, shortest_run)
        # To gather with d_pq is to scatter with d_qp.
        weights = divergence.weights(pairs, weights, particles.volumes)[pairs.reversed_order()]
        force = compressed(in_chunks(pairs, weights), d, dtype, shortest_run)
        factors = np.ones(n)
    return ReferenceBody.of(body, law, gradient, force, factors, count)
