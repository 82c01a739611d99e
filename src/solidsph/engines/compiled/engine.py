"""The compiled engine: fused sweeps over stencils and rows, compiled for the parts in use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, final

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.arrays import Array, Indices
from solidsph.body import Body, part_of
from solidsph.dynamics import Dynamics
from solidsph.engines.compiled.blocks import STRIDE, group
from solidsph.engines.compiled.chunks import weighted_chunks
from solidsph.engines.compiled.history import CompiledLaw
from solidsph.engines.compiled.loop import are_declared, compiled_loop
from solidsph.engines.compiled.moving import MovingBody, moving_body
from solidsph.engines.compiled.part import part_of_rows
from solidsph.engines.compiled.pointwise import NotCompilableError, compiled_flux, no_law
from solidsph.engines.compiled.rows import (
    Rows,
    compressed,
    in_chunks,
)
from solidsph.engines.compiled.shares import (
    Passes,
    Shares,
    aligned,
    passes,
    shared,
    spread_pass,
    thread_count,
)
from solidsph.engines.engine import Engine, InternalForces, StressFields
from solidsph.engines.history import ArrayLaw, Law
from solidsph.engines.matrix import MatrixEngine
from solidsph.engines.tally import Tally, Way, vectors
from solidsph.interfaces.condition import StressCondition
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.integrator import Integrator
from solidsph.neighbours import Pairs
from solidsph.tensors import components_first, particles_first
from solidsph.time_loop import TimeLoop

# Particles whose stress is found at once for reports and records.
_AT_ONCE = 4096


@final
@attrs.frozen
class CompiledEngine(Engine):
    """Sums over rows of weights, with the parts' pointwise functions compiled into the loops.

    Where a material or a formulation cannot be compiled, the matrix engine does the work: for all
    bodies, because conditions see the stress of all at once.

    The sums themselves are kept in `precision`, if they are taken in the reference configuration:
    what moves is summed in double precision. Displacements, and not positions, go into them, so
    that single precision is precision of strain, as long as a body does not move by many times its
    spacing; F, the stress and what the seam hands out are in double precision.
    """

    precision: str = attrs.field(
        default="float64", validator=attrs.validators.in_(("float64", "float32"))
    )

    def prepare(
        self,
        bodies: Sequence[Body],
        conditions: Sequence[StressCondition],
        evaluations: int = 1,
    ) -> InternalForces:
        try:
            laws = [compiled_flux(b.formulation, b.material, b.smoothing.dimension) for b in bodies]
        except NotCompilableError:
            return MatrixEngine().prepare(bodies, conditions)
        parts = [self._part(b, law) for b, law in zip(bodies, laws, strict=True)]
        return CompiledForces(tuple(parts), tuple(conditions))

    def _part(self, body: Body, law: Any) -> CompiledBody | MovingBody:
        if body.formulation.configuration is Configuration.REFERENCE:
            return _part(body, law, self.precision)
        return moving_body(body, law)


@final
@attrs.frozen(eq=False)
class CompiledBody:
    """One body made ready: weights, work space, and the passes over them."""

    body: Body
    law: Any  # compiled (H, params) -> T
    gradient: Rows
    force: Rows  # those that are scattered with; the gradient's own for the adjoint divergence
    factors: NDArray[Any]  # (n,) what multiplies the stress before it is scattered
    gradient_shares: Shares
    force_shares: Shares
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
        shares = {id(one): one.buffers.nbytes for one in (self.gradient_shares, self.force_shares)}
        own = self.factors.nbytes + self.u.nbytes
        return own + sum(rows.values()) + sum(shares.values())

    @property
    def tally(self) -> Sequence[Tally]:
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
        precision, threaded = self.u.itemsize, self.gradient_shares.threaded
        return (
            Tally(Way.STENCILS, run_pairs, ran, touched, held, precision, threaded),
            Tally(Way.ROWS, row_pairs, n - ran, row_bytes, row_bytes, precision, threaded),
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
        shares = self.gradient_shares
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
        self.gradient_shares.check()
        passes.stress(
            self.gradient_shares.table,
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
        shares = self.force_shares
        self.spread_pass(shares.table, self.force, stress, self.factors, shares.buffers, out)
        if acts:
            # Ghosts have acted through their stress; nothing acts on them.
            out[ghosts] = 0.0


def _part(body: Body, law: Any, dtype: str) -> CompiledBody:
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
    gradient_shares = shared(gradient, d, dtype, threads)
    force_shares = gradient_shares if divergence.adjoint else shared(force, d, dtype, threads)
    return CompiledBody(
        body=body,
        law=law,
        gradient=gradient,
        force=force,
        factors=factors.astype(dtype),
        gradient_shares=gradient_shares,
        force_shares=force_shares,
        # Loops over runs read beyond the last particle by up to a group.
        u=aligned((n + group(d, dtype)) * STRIDE[d], dtype),
        passes=passes(d, dtype, law, threads > 1),
        gradients=passes(d, dtype, no_law, threads > 1),
        spread_pass=spread_pass(d, dtype, threads > 1),
        pair_count=count,
    )


@final
@attrs.frozen(eq=False)
class CompiledForces(InternalForces):
    """Internal forces by compiled sweeps."""

    parts: Sequence[CompiledBody | MovingBody]
    conditions: Sequence[StressCondition]

    @property
    def pair_count(self) -> int:
        return sum(part.pair_count for part in self.parts)

    @property
    def tally(self) -> Sequence[Tally]:
        return tuple(own for part in self.parts for own in part.tally)

    @property
    def precision(self) -> float:
        return max(part.precision for part in self.parts)

    def compiles_steps(self, dynamics: Dynamics, integrator: Integrator) -> bool:
        fixed = self._fixed
        return len(fixed) == len(self.parts) and are_declared(
            fixed, self.conditions, dynamics, integrator
        )

    @property
    def _fixed(self) -> Sequence[CompiledBody]:
        return [part for part in self.parts if isinstance(part, CompiledBody)]

    def time_loop(self, dynamics: Dynamics, integrator: Integrator, step_size: float) -> TimeLoop:
        if self.compiles_steps(dynamics, integrator):
            try:
                return compiled_loop(self._fixed, self.conditions, dynamics, integrator, step_size)
            except NotCompilableError:  # a formula does not compile, as its kind did not tell
                pass
        return super().time_loop(dynamics, integrator, step_size)

    def forces(self, time: float, displacements: Array) -> Array:
        forces = np.empty(displacements.shape)
        fused = [part for part in self.parts if part.fused and not self.conditions]
        staged = [part for part in self.parts if part not in fused]
        for part in fused:
            extent = part.body.extent
            part.forces(displacements[extent], forces[extent])
        if staged:
            n, d = displacements.shape
            stress = np.zeros((d, d, n))
            for part in staged:
                extent = part.body.extent
                part.stress(displacements[extent], stress[:, :, extent])
            for condition in self.conditions:
                condition.impose_stress(time, stress)
            for part in staged:
                extent = part.body.extent
                part.spread(stress[:, :, extent], forces[extent])
        return forces

    def gradients(self, displacements: Array) -> Array:
        n, d = displacements.shape
        H = np.zeros((n, d, d))
        for part in self.parts:
            part.gradient_of(displacements[part.body.extent], H[part.body.extent])
        return H

    def spread(self, displacements: Array, stress: Array) -> Array:
        forces = np.empty(displacements.shape)
        for part in self.parts:
            part.spread(stress[:, :, part.body.extent], forces[part.body.extent])
        return forces

    def check_parts(self) -> None:
        if self._whole is None:
            super().check_parts()

    def part(self, chosen: Indices) -> InternalForces:
        whole = self._whole
        if whole is None:
            return super().part(chosen)
        d, dtype = whole.body.particles.dimension, whole.u.dtype.name
        rows = part_of_rows(whole.gradient, chosen, whole.body.particles.count)
        count = rows.run_pairs + rows.row_pairs
        threads = thread_count(count)
        shares = shared(rows, d, dtype, threads)
        own = attrs.evolve(
            whole,
            body=part_of(whole.body, chosen),
            gradient=rows,
            force=rows,
            factors=whole.factors[chosen],
            gradient_shares=shares,
            force_shares=shares,
            u=aligned((len(chosen) + group(d, dtype)) * STRIDE[d], dtype),
            passes=passes(d, dtype, whole.law, threads > 1),
            gradients=passes(d, dtype, no_law, threads > 1),
            spread_pass=spread_pass(d, dtype, threads > 1),
            pair_count=count,
        )
        return CompiledForces((own,), ())

    @property
    def _whole(self) -> CompiledBody | None:
        """The only body, if its forces may be formed in parts."""
        if self.conditions or len(self.parts) > 1 or not isinstance(self.parts[0], CompiledBody):
            return None
        only = self.parts[0]
        return only if only.fused and not only.body.particles.ghosts.any() else None

    def law(self, body: Body) -> Law:
        try:
            return CompiledLaw.of(body)
        except NotCompilableError:
            return ArrayLaw(body)

    def fields(self, displacements: Array) -> StressFields:
        n, d = displacements.shape
        fields = StressFields(np.empty((n, d, d)), np.zeros((n, d, d)), np.zeros(n))
        for part in self.parts:
            extent = part.body.extent
            F, P = fields.deformation_gradients[extent], fields.stresses[extent]
            energy = fields.energy_densities[extent]
            part.gradient_of(displacements[extent], F)
            for some in _portions(part.body.particles.count):
                F[some] = _deformation(part.body, F[some])
            F[part.body.particles.ghosts] = np.eye(d)
            for some in _portions(part.body.particles.count):
                P[some], energy[some] = _stress_and_energy(part.body, F[some])
        return fields


def _portions(count: int) -> Iterator[slice]:
    """Particles 0 to `count`, some at a time: what the law needs between stays in cache."""
    return (slice(first, first + _AT_ONCE) for first in range(0, count, _AT_ONCE))


def _deformation(body: Body, H: Array) -> Array:
    """F (k, d, d) from H (k, d, d)."""
    with np.errstate(all="ignore"):  # as in the matrix engine
        F = body.formulation.deformation_gradient(components_first(H))
    return particles_first(F, len(H))


def _stress_and_energy(body: Body, F: Array) -> tuple[Array, Array]:
    """P (k, d, d) and psi (k,) from F (k, d, d)."""
    components = components_first(F)
    with np.errstate(all="ignore"):  # as in the matrix engine
        P = body.material.first_piola(components, body.material.params)
        energy = body.material.energy(components, body.material.params)
    return particles_first(P, len(F)), energy
