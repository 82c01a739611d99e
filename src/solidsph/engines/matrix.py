"""The matrix engine: the paper's form (section 2.2), sums as products of sparse matrices.

It needs no compilation and is the reference that every other engine is compared with.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array, hstack, vstack

from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.plan import BodySize, Operations, Plan, SumMethod, array_bytes, vectors
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Indices, Mask, Tensor
from solidsph.maths.tensors import identity, particles_first
from solidsph.model.neighbours import Pairs, neighbour_pairs


@attrs.frozen(eq=False)
class Operators:
    """Gradient and force matrices of one body in one configuration."""

    gradient: csr_array  # (d n, n): row k n + p gives the derivative along axis k at p [1/m]
    force: csr_array  # (n, d n): from stress components along axis k to force [m^(d-1)]

    def part(self, chosen: Indices) -> Operators:
        """Those of the chosen particles; rows that reach beyond them are left out."""
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
        """Memory of both."""
        return sum(
            array_bytes((matrix.data, matrix.indices, matrix.indptr))
            for matrix in (self.gradient, self.force)
        )


def operators(body: Body, pairs: Pairs, crowding: Array | float = 1.0) -> Operators:
    """The matrices X_k of the paper's eq. 10, and those of the divergence.

    `crowding` is how many times their reference volume the particles have now, (n,) or 1.
    """
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    cells, volumes = body.particles.cells * crowding, body.particles.volumes * crowding
    gradient = body.formulation.gradient.weights(pairs, kernel_gradients, cells)
    force = body.formulation.divergence.weights(pairs, gradient, volumes)
    return assembled(pairs, gradient, force)


def assembled(pairs: Pairs, gradient: Array, force: Array) -> Operators:
    """The matrices of the weights (m, d) of a gradient and of the divergence."""
    axes = range(gradient.shape[1])
    return Operators(
        gradient=csr_array(vstack([pairs.matrix(gradient[:, k]) for k in axes], format="csr")),
        force=csr_array(hstack([pairs.matrix(force[:, k]) for k in axes], format="csr")),
    )


@final
@attrs.frozen(eq=False)
class _FixedBody:
    """A body whose sums are taken in the reference configuration: the matrices are constant."""

    body: Body
    constant: Operators

    def operators(self, displacements: Array) -> Operators:
        return self.constant

    @property
    def operations(self) -> Operations:
        """What an evaluation passes over."""
        n, d = self.body.particles.positions.shape
        held = self.constant.bytes
        pairs = self.constant.gradient.nnz // d
        return Operations(SumMethod.PRODUCTS, pairs, n, held + vectors(n, d), held)


@final
@attrs.frozen(eq=False)
class _FollowedBody:
    """A body whose neighbours, kernel and volumes are found anew at every step."""

    body: Body
    reference_sums: Array  # (n,) sum of V_q W at the start, the measure of a full neighbourhood
    pair_count: int  # at the start

    def operators(self, displacements: Array) -> Operators:
        body, particles = self.body, self.body.particles
        positions = particles.positions + displacements
        pairs = neighbour_pairs(positions, body.smoothing.support_radius, body.hidden)
        # The volume follows the crowding of particles, relative to that of the reference
        # configuration, so that the deficit at a surface cancels.
        return operators(body, pairs, self.reference_sums / kernel_sums(body, pairs))

    @property
    def operations(self) -> Operations:
        """What an evaluation passes over, with the neighbours of the start."""
        n, d = self.body.particles.positions.shape
        # Pairs, and both matrices: numbers and indices of 8 bytes, written and read.
        matrices = 2 * self.pair_count * d * (8 + 8)
        pairs = self.pair_count * (8 * d + 3 * 8)
        held = self.reference_sums.nbytes
        touched = held + 2 * (matrices + pairs) + vectors(n, d)
        return Operations(SumMethod.PRODUCTS_ANEW, self.pair_count, n, touched, held)


def kernel_sums(body: Body, pairs: Pairs) -> Array:
    """Sum over neighbours of W_pq by reference cells, (n,) [-]."""
    weights = body.smoothing.value(pairs.distances) * body.particles.cells[pairs.columns]
    return pairs.row_sums(weights)


@final
@attrs.frozen(eq=False)
class MatrixForces(InternalForces):
    """Internal forces by sparse products."""

    parts: Sequence[_FixedBody | _FollowedBody]
    conditions: Sequence[StressTerm]
    pair_count: int

    @property
    def operations(self) -> Sequence[Operations]:
        return tuple(part.operations for part in self.parts)

    def forces(self, time: float, displacements: Array) -> Array:
        n, d = displacements.shape
        stress = np.empty((d, d, n))
        all_operators = []
        with np.errstate(all="ignore"):  # a run that leaves the material's domain is caught later
            for part in self.parts:
                body = part.body
                matrices = part.operators(displacements[body.extent])
                F = _deformation_gradient(body, matrices, displacements[body.extent])
                P = body.material.first_piola(F, body.material.params)
                T = body.formulation.flux(F, P)
                for i in range(d):
                    for k in range(d):
                        stress[i, k, body.extent] = np.where(body.particles.ghosts, 0.0, T[i][k])
                all_operators.append(matrices)
        for condition in self.conditions:
            condition.impose_stress(time, stress)
        return self._spread(all_operators, stress)

    def gradients(self, displacements: Array) -> Array:
        n, d = displacements.shape
        H = np.empty((n, d, d))
        for part in self.parts:
            own = displacements[part.body.extent]
            H[part.body.extent] = np.moveaxis(_gradient(part.operators(own), own), -1, 0)
        return H

    def spread(self, displacements: Array, stress: Array) -> Array:
        own = [part.operators(displacements[part.body.extent]) for part in self.parts]
        return self._spread(own, stress)

    def _spread(self, all_operators: Sequence[Operators], stress: Array) -> Array:
        d, _, n = stress.shape
        for part in self.parts:
            if not part.body.formulation.divergence.uses_ghost_stress:
                stress[:, :, part.body.extent][:, :, part.body.particles.ghosts] = 0.0
        forces = np.empty((n, d))
        for part, matrices in zip(self.parts, all_operators, strict=True):
            own = stress[:, :, part.body.extent]
            # Components along axis k stand in block k, as the columns of the force matrix do.
            stacked = own.transpose(1, 2, 0).reshape(-1, d)
            force = matrices.force @ stacked
            if part.body.formulation.divergence.uses_ghost_stress:
                # Ghosts have acted through their stress; nothing acts on them.
                force[part.body.particles.ghosts] = 0.0
            forces[part.body.extent] = force
        return forces

    def check_parts(self) -> None:
        if self._whole is None:
            super().check_parts()

    def part(self, chosen: Indices) -> InternalForces:
        whole = self._whole
        if whole is None:
            return super().part(chosen)
        body = part_of(whole.body, chosen)
        return fixed_forces([body], [whole.constant.part(chosen)], ())

    @property
    def _whole(self) -> _FixedBody | None:
        """The only body, if its forces may be formed in parts."""
        if self.conditions or len(self.parts) > 1 or not isinstance(self.parts[0], _FixedBody):
            return None
        return None if self.parts[0].body.particles.ghosts.any() else self.parts[0]

    def fields(self, displacements: Array) -> StressFields:
        n, d = displacements.shape
        fields = StressFields(np.empty((n, d, d)), np.zeros((n, d, d)), np.zeros(n))
        for part in self.parts:
            body, extent = part.body, part.body.extent
            ghosts = body.particles.ghosts
            with np.errstate(all="ignore"):
                F = _deformation_gradient(
                    body, part.operators(displacements[extent]), displacements[extent]
                )
                F = _without_ghosts(F, ghosts)
                count = len(ghosts)
                P = body.material.first_piola(F, body.material.params)
                energy = body.material.energy(F, body.material.params)
            fields.deformation_gradients[extent] = particles_first(F, count)
            fields.stresses[extent] = particles_first(P, count)
            fields.energy_densities[extent] = energy
        return fields


def _deformation_gradient(body: Body, matrices: Operators, displacements: Array) -> Tensor:
    return body.formulation.deformation_gradient(_gradient(matrices, displacements))


def _gradient(matrices: Operators, displacements: Array) -> Array:
    """H (d, d, n)."""
    n, d = displacements.shape
    along = (matrices.gradient @ displacements).reshape(d, n, d)
    return along.transpose(2, 0, 1)  # H[i][k] = du_i / dx_k


def _without_ghosts(F: Tensor, ghosts: Mask) -> Tensor:
    one = identity(F)
    axes = range(len(F))
    return tuple(tuple(np.where(ghosts, one[i][k], F[i][k]) for k in axes) for i in axes)


def fixed_forces(
    bodies: Sequence[Body], constant: Sequence[Operators], conditions: Sequence[StressTerm]
) -> MatrixForces:
    """Internal forces of bodies by matrices that are given."""
    parts = [_FixedBody(body, own) for body, own in zip(bodies, constant, strict=True)]
    return MatrixForces(parts, conditions, sum(part.operations.pairs for part in parts))


@final
@attrs.frozen
class MatrixEngine(Engine):
    """Sums as sparse matrix products."""

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        return Plan(False, tuple(_expected(size) for size in sizes))

    def prepare(
        self,
        bodies: Sequence[Body],
        conditions: Sequence[StressTerm],
        evaluations: int = 1,
    ) -> InternalForces:
        parts: list[_FixedBody | _FollowedBody] = []
        count = 0
        for body in bodies:
            pairs = body.pairs()
            count += pairs.count
            if body.formulation.configuration is Configuration.REFERENCE:
                matrices = operators(body, pairs)
                parts.append(_FixedBody(body, matrices))
            else:
                parts.append(_FollowedBody(body, kernel_sums(body, pairs), pairs.count))
        return MatrixForces(tuple(parts), tuple(conditions), count)


def _expected(size: BodySize) -> Operations:
    n, m, d = round(size.particles), round(size.pairs), size.dimension
    # Numbers and indices of two matrices, and where their rows begin.
    matrices = 2 * m * d * (8 + 8) + 8 * n * (d + 1)
    if size.moving:
        return Operations(SumMethod.PRODUCTS_ANEW, m, n, 2 * matrices, 8 * n)
    return Operations(SumMethod.PRODUCTS, m, n, matrices + vectors(n, d), matrices)
