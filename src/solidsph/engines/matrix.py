"""The matrix engine: sums as products of sparse matrices, as in section 2.2 of the paper.

It needs no compilation and is the reference for every other engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csr_array, diags_array, hstack, vstack

from solidsph.engines.array_law import flux, stress_fields
from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.plan import BodySize, Operations, Plan, SumMethod, array_bytes, vectors
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs, neighbour_pairs

# Of rows and columns in a sparse matrix.
_Numbers = NDArray[np.int32]


@attrs.frozen(eq=False)
class Operators:
    """Gradient and force matrices of one body in one configuration."""

    gradient: csr_array  # (d n, n): row k n + p gives the derivative along axis k at p [1/m]
    force: csr_array  # (n, d n): from stress components along axis k to force [m^(d-1)]

    def gradients(self, field: Array) -> Array:
        """Gradient (d, d, n) of a vector field (n, d)."""
        n, d = field.shape
        along = (self.gradient @ field).reshape(d, n, d)
        return np.asarray(along.transpose(2, 0, 1))  # H[i][k] = du_i / dx_k

    def forces(self, stress: Array) -> Array:
        """Forces (n, d) [N] of a stress (d, d, n) [Pa]."""
        # Components along axis k stand in block k, as the columns of the force matrix do.
        return np.asarray(self.force @ stress.transpose(1, 2, 0).reshape(-1, len(stress)))

    def own_stiffness(self, moduli: Array) -> Array:
        """Blocks (n, d, d) [N/m] of the stiffness with moduli (n, d, d, d, d) [Pa]."""
        n, d = moduli.shape[:2]
        blocks = np.zeros((n, d, d))
        for k in range(d):
            force = self.force[:, k * n : (k + 1) * n]
            for other in range(d):
                both = force.multiply(self.gradient[other * n : (other + 1) * n].T)
                blocks -= (both @ moduli[:, :, k, :, other].reshape(n, -1)).reshape(n, d, d)
        return blocks

    def stress_changes(self, moduli: Array) -> bsr_array:
        """Matrix (d d n, d n) [Pa/m] of the change of stress by displacements.

        Row (p d + i) d + k is component ik at p, column q d + j is component j of q, with moduli
        dP_ik / dF_jl (n, d, d, d, d) [Pa].
        """
        n, d = moduli.shape[:2]
        starts, columns, changes = self._changes(moduli)
        values = changes.transpose(0, 2, 1, 3).reshape(-1, d * d, d)
        return bsr_array((values, columns, starts), shape=(d * d * n, d * n))

    def of_stresses(self, left_out: Mask | None = None) -> bsr_array:
        """Matrix (d n, d d n) [m^(d-1)] from stresses to forces, in the order of `stress_changes`.

        There are no forces on the particles `left_out` (n,).
        """
        starts, columns, f = self._weights(left_out)
        n, d = len(starts) - 1, f.shape[1]
        weights = np.einsum("ij,mk->mijk", np.eye(d), f).reshape(-1, d, d * d)
        return bsr_array((weights, columns, starts), shape=(d * n, d * d * n))

    def stiffness(self, moduli: Array, left_out: Mask | None = None) -> bsr_array:
        """Minus `of_stresses` times `stress_changes`, (d n, d n) [N/m]."""
        n, d = moduli.shape[:2]
        starts, columns, f = self._weights(left_out)
        forces = bsr_array((-f[:, None], columns, starts), shape=(n, d * n))
        starts, columns, changes = self._changes(moduli)
        # Components i and j of a block in one row: sums over k alone take a third of the time.
        values = changes.reshape(-1, d, d * d)
        whole = forces @ bsr_array((values, columns, starts), shape=(d * n, d * d * n))
        blocks = whole.data.reshape(-1, d, d)
        return bsr_array((blocks, whole.indices, whole.indptr), shape=(d * n, d * n))

    def _changes(self, moduli: Array) -> tuple[_Numbers, _Numbers, Array]:
        """Where rows begin, columns, and by the pair (m, k, i, j) the change of P_ik by u_j."""
        n, d = moduli.shape[:2]
        blocks = [self.gradient[k * n : (k + 1) * n] for k in range(d)]
        starts, columns = blocks[0].indptr, blocks[0].indices
        g = np.stack([block.data for block in blocks], axis=1)[:, :, None]
        gradient = bsr_array((g, columns, starts), shape=(d * n, n))
        # A product of blocks: no moduli of pairs.
        A = moduli.transpose(0, 2, 1, 3, 4).reshape(n, d**3, d)
        every = bsr_array((A, np.arange(n), np.arange(n + 1)), shape=(d**3 * n, d * n))
        changes = every @ gradient
        return changes.indptr, changes.indices, changes.data.reshape(-1, d, d, d)

    def _weights(self, left_out: Mask | None) -> tuple[_Numbers, _Numbers, Array]:
        """Where rows begin, columns, and by the pair the weights (m, d) of the divergence."""
        n = self.force.shape[0]
        blocks = [self.force[:, k * n : (k + 1) * n] for k in range(self.force.shape[1] // n)]
        starts, columns = blocks[0].indptr, blocks[0].indices
        f = np.stack([block.data for block in blocks], axis=1)
        if left_out is not None:
            f[np.repeat(left_out, np.diff(starts))] = 0.0
        return starts, columns, f

    def part(self, chosen: Indices) -> Operators:
        """The matrices of the chosen particles; rows that reach beyond these are left out."""
        n = self.force.shape[0]
        gradients, forces = [], []
        for k in range(self.gradient.shape[0] // n):
            rows = csr_array(self.gradient[k * n + chosen])
            inside = csr_array(rows[:, chosen])
            complete = np.diff(inside.indptr) == np.diff(rows.indptr)
            keep = diags_array(complete.astype(np.float64), format="csr")
            gradients.append(keep @ inside)
            forces.append(csr_array(csr_array(self.force[chosen])[:, k * n + chosen]) @ keep)
        return Operators(
            csr_array(vstack(gradients, format="csr")), csr_array(hstack(forces, format="csr"))
        )

    @property
    def bytes(self) -> int:
        """Memory of both [bytes]."""
        both = (self.gradient, self.force)
        return array_bytes(a for m in both for a in (m.data, m.indices, m.indptr))


def operators(body: Body, pairs: Pairs, crowding: Array | float = 1.0) -> Operators:
    """The matrices X_k of the paper's eq. 10, and those of the divergence.

    `crowding` is the current volume of each particle over its reference volume, (n,) or 1.

    Raises:
        BuildError: the neighbours of a particle do not determine a gradient.
    """
    kernel_gradients = body.smoothing.gradients_of(pairs)
    cells, volumes = body.particles.cells * crowding, body.particles.volumes * crowding
    gradient = body.formulation.gradient.weights(pairs, kernel_gradients, cells)
    force = body.formulation.divergence.weights(pairs, gradient, volumes)
    return assembled(pairs, gradient, force)


def assembled(pairs: Pairs, gradient: Array, force: Array) -> Operators:
    """The matrices with weights (m, d) of the gradient and of the divergence at `pairs`."""
    axes = range(gradient.shape[1])
    return Operators(
        gradient=csr_array(vstack([pairs.matrix(gradient[:, k]) for k in axes], format="csr")),
        force=csr_array(hstack([pairs.matrix(force[:, k]) for k in axes], format="csr")),
    )


@final
@attrs.frozen(eq=False)
class _ReferenceBody:
    """A body whose sums are taken in the reference configuration, by constant matrices."""

    body: Body
    constant: Operators

    def operators(self, displacements: Array) -> Operators:
        return self.constant

    @property
    def operations(self) -> Operations:
        """Operations of one evaluation."""
        n, d = self.body.particles.positions.shape
        held = self.constant.bytes
        pairs = self.constant.gradient.nnz // d
        return Operations(SumMethod.PRODUCTS, pairs, n, held + vectors(n, d), held)


@final
@attrs.frozen(eq=False)
class _MovingBody:
    """A body whose neighbours, kernel values and volumes are recomputed at every evaluation."""

    body: Body
    reference_sums: Array  # (n,) sum of V_q W in the reference configuration [-]
    pair_count: int  # in the reference configuration

    def operators(self, displacements: Array) -> Operators:
        body, particles = self.body, self.body.particles
        positions = particles.positions + displacements
        pairs = neighbour_pairs(positions, body.smoothing.support_radius, body.hidden)
        # The volume follows the crowding of particles, relative to that of the reference
        # configuration, so that the deficit at a surface cancels.
        return operators(body, pairs, self.reference_sums / kernel_sums(body, pairs))

    @property
    def operations(self) -> Operations:
        """Operations of one evaluation, with the initial neighbours."""
        n, d = self.body.particles.positions.shape
        # Pairs, and both matrices: numbers and indices of 8 bytes, written and read.
        matrices = 2 * self.pair_count * d * (8 + 8)
        pairs = self.pair_count * (8 * d + 3 * 8)
        held = self.reference_sums.nbytes
        touched = held + 2 * (matrices + pairs) + vectors(n, d)
        return Operations(SumMethod.PRODUCTS_ANEW, self.pair_count, n, touched, held)


def kernel_sums(body: Body, pairs: Pairs) -> Array:
    """Sum over neighbours of W_pq by reference cells, (n,) [-]."""
    weights = body.smoothing.values_of(pairs) * body.particles.cells[pairs.columns]
    return pairs.row_sums(weights)


@final
@attrs.frozen(eq=False)
class MatrixForces(InternalForces):
    """Internal forces by sparse products."""

    parts: Sequence[_ReferenceBody | _MovingBody]
    conditions: Sequence[StressTerm]
    pair_count: int

    @property
    def operations(self) -> Sequence[Operations]:
        return tuple(part.operations for part in self.parts)

    def forces(self, time: float, displacements: Array) -> Array:
        n, d = displacements.shape
        stress = np.empty((d, d, n))
        matrices = []
        with np.errstate(all="ignore"):  # a run that leaves the material's domain is caught later
            for part in self.parts:
                extent, ghosts = part.body.extent, part.body.particles.ghosts
                own = part.operators(displacements[extent])
                T = flux(part.body, own.gradients(displacements[extent]))
                for i in range(d):
                    for k in range(d):
                        stress[i, k, extent] = np.where(ghosts, 0.0, T[i][k])
                matrices.append(own)
        for condition in self.conditions:
            condition.impose_stress(time, stress)
        return self._spread(matrices, stress)

    def constant_operators(self) -> Sequence[Operators]:
        """The matrices of each body; all sums must be taken in the reference configuration."""
        fixed = [part.constant for part in self.parts if isinstance(part, _ReferenceBody)]
        assert len(fixed) == len(self.parts), "the matrices of moving neighbours change"
        return fixed

    def gradients(self, displacements: Array) -> Array:
        n, d = displacements.shape
        H = np.empty((n, d, d))
        for part in self.parts:
            own = displacements[part.body.extent]
            H[part.body.extent] = np.moveaxis(part.operators(own).gradients(own), -1, 0)
        return H

    def spread(self, displacements: Array, stress: Array) -> Array:
        matrices = [part.operators(displacements[part.body.extent]) for part in self.parts]
        return self._spread(matrices, stress)

    def own_stiffness(self, moduli: Array) -> Array | None:
        if not all(isinstance(part, _ReferenceBody) for part in self.parts):
            return None
        n, d = len(moduli), self.parts[0].body.particles.dimension
        each = [
            own.own_stiffness(moduli[part.body.extent].reshape(-1, d, d, d, d))
            for part, own in zip(self.parts, self.constant_operators(), strict=True)
        ]
        return np.concatenate(each).reshape(n, d, d)

    def _spread(self, matrices: Sequence[Operators], stress: Array) -> Array:
        d, _, n = stress.shape
        forces = np.empty((n, d))
        for part, own in zip(self.parts, matrices, strict=True):
            extent, ghosts = part.body.extent, part.body.particles.ghosts
            ghosts_act = part.body.formulation.divergence.uses_ghost_stress
            if not ghosts_act:
                stress[:, :, extent][:, :, ghosts] = 0.0
            force = own.forces(stress[:, :, extent])
            if ghosts_act:
                # Ghosts have acted through their stress; no force acts on them.
                force[ghosts] = 0.0
            forces[extent] = force
        return forces

    def part(self, chosen: Indices) -> InternalForces | None:
        only = self.parts[0]
        if self.conditions or len(self.parts) > 1 or not isinstance(only, _ReferenceBody):
            return None
        if only.body.particles.ghosts.any():
            return None
        return fixed_forces([part_of(only.body, chosen)], [only.constant.part(chosen)], ())

    def fields(self, displacements: Array) -> StressFields:
        with np.errstate(all="ignore"):  # as in `forces`
            H = self.gradients(displacements)
        return stress_fields([part.body for part in self.parts], H)


def fixed_forces(
    bodies: Sequence[Body], constant: Sequence[Operators], conditions: Sequence[StressTerm]
) -> MatrixForces:
    """Internal forces of bodies with given matrices."""
    parts = [_ReferenceBody(body, own) for body, own in zip(bodies, constant, strict=True)]
    return MatrixForces(parts, conditions, sum(part.operations.pairs for part in parts))


@final
@attrs.frozen
class MatrixEngine(Engine):
    """Sums as sparse matrix products."""

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        return Plan(False, tuple(_expected(size) for size in sizes))

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        parts: list[_ReferenceBody | _MovingBody] = []
        count = 0
        for body in bodies:
            pairs = body.pairs()
            count += pairs.count
            if body.formulation.configuration is Configuration.REFERENCE:
                parts.append(_ReferenceBody(body, operators(body, pairs)))
            else:
                parts.append(_MovingBody(body, kernel_sums(body, pairs), pairs.count))
        return MatrixForces(tuple(parts), tuple(conditions), count)


def _expected(size: BodySize) -> Operations:
    n, m, d = round(size.particles), round(size.pairs), size.dimension
    # Numbers and indices of two matrices, and where their rows begin.
    matrices = 2 * m * d * (8 + 8) + 8 * n * (d + 1)
    if size.moving:
        return Operations(SumMethod.PRODUCTS_ANEW, m, n, 2 * matrices, 8 * n)
    return Operations(SumMethod.PRODUCTS, m, n, matrices + vectors(n, d), matrices)
