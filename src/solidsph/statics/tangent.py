"""Tangent stiffness: minus the derivative of the forces by the displacements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy.sparse import block_diag, bsr_array, csr_array, diags_array

from solidsph.engines.matrix import MatrixForces, Operators
from solidsph.errors import SolidsphError
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.terms import Load, StressTerm
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.linear_part import linear_part
from solidsph.statics.stiff import is_stiff
from solidsph.statics.sums import sums_by_matrices


@attrs.frozen(eq=False)
class _BodyTangent:
    """What the tangent of one body needs besides its sums."""

    body: Body
    stresses: csr_array | None  # (d d n, d d n) extends stresses of real particles to ghosts

    def moduli(self, F: Array, ahead: Array) -> Array:
        """dT_ik / dF_jl of all particles, (n, d, d, d, d) [Pa], at F (n, d, d)."""
        A = _moduli(self.body, F)
        A += np.einsum("ij,pkl->pikjl", np.eye(F.shape[1]), ahead)
        return A

    def matrix(self, constant: Operators, A: Array) -> csr_array:
        """(d n, d n) [N/m] with moduli (n, d, d, d, d)."""
        n, d = A.shape[:2]
        blocks = [constant.gradient[k * n : (k + 1) * n] for k in range(d)]
        g = np.stack([block.data for block in blocks], axis=1)
        # Change of stress T_ik at p per displacement of q along j, in blocks (p, q).
        starts, columns = blocks[0].indptr, blocks[0].indices
        changes = np.einsum("mikjl,ml->mikj", np.repeat(A, np.diff(starts), axis=0), g)
        of_displacement = bsr_array(
            (changes.reshape(-1, d * d, d), columns, starts), shape=(d * d * n, d * n)
        )
        return csr_array(-(self._force(constant, n, d) @ self._extended(of_displacement)))

    def stress(self, stresses: Array) -> Array:
        """Stresses (n, d, d) at real particles, extended to ghosts."""
        real = np.where(self.body.particles.ghosts[:, None, None], 0.0, stresses)
        extended: Array = self._extended(real.ravel()).reshape(stresses.shape)
        return extended

    def ahead(self, before: Array, dF: Array, after: Array) -> Array:
        """`Tangent.ahead` from F before (n, d, d), its linear change and F after the step."""
        n, d = before.shape[:2]
        ghosts = self.body.particles.ghosts
        if not self.body.material.objective:  # linear forces have no geometric stiffness
            return np.zeros((n, d, d))
        material, identity = self.body.material, np.eye(d)
        before = np.where(ghosts[:, None, None], identity, before)
        after = np.where(ghosts[:, None, None], identity, after)
        dP = particles_first(
            material.tangent(components_first(before), components_first(dF), material.params), n
        )
        S = _second_piola(self.body, before)
        predicted = S + np.linalg.solve(before, dP - dF @ S)
        lead: Array = predicted - _second_piola(self.body, after)
        lead[ghosts] = 0.0
        return lead

    def _extended(self, stresses: Any) -> Any:
        """Stresses of real particles, or their derivative, extended to ghosts."""
        return stresses if self.stresses is None else self.stresses @ stresses

    def _force(self, constant: Operators, n: int, d: int) -> bsr_array:
        """Matrix (d n, d d n) from stress components (j, k) at q to forces along i at p."""
        blocks = [constant.force[:, k * n : (k + 1) * n] for k in range(d)]
        f = np.stack([block.data for block in blocks], axis=1)
        if self.body.formulation.divergence.uses_ghost_stress:  # nothing acts on ghosts then
            f[np.repeat(self.body.particles.ghosts, np.diff(blocks[0].indptr))] = 0.0
        weights = np.einsum("ij,mk->mijk", np.eye(d), f).reshape(-1, d, d * d)
        return bsr_array((weights, blocks[0].indices, blocks[0].indptr), shape=(d * n, d * d * n))


@attrs.frozen(eq=False)
class Tangent:
    """Tangent of a scene, by the sums of its internal forces."""

    bodies: Sequence[_BodyTangent]
    internal: InternalForces  # in double precision
    loads: Sequence[Load]

    @classmethod
    def of(cls, simulation: BuiltScene, internal: InternalForces) -> Tangent:
        """Prepare the tangent of a scene, whose sums are those of `internal`.

        Raises:
            SolidsphError: a formulation is not the total Lagrangian form.
        """
        bodies = simulation.model.bodies
        for body in bodies:
            _check_form(body.formulation, simulation.particles.dimension)
        conditions = [c for c in simulation.terms if isinstance(c, StressTerm)]
        return cls(
            [
                _BodyTangent(body, _stress_extension(body, simulation, conditions))
                for body in bodies
            ],
            internal,
            simulation.dynamics.loads,
        )

    def moduli(self, displacements: Array, ahead: Array | None = None) -> Array:
        """dT_ik / dF_jl of all particles, (n, d, d, d, d) [Pa], at displacements (n, d).

        `ahead` (n, d, d) is added to the second Piola-Kirchhoff stress of the geometric stiffness.
        """
        F = self._deformation_gradients(displacements)
        if ahead is None:
            ahead = np.zeros_like(F)
        return np.concatenate(
            [part.moduli(F[part.body.extent], ahead[part.body.extent]) for part in self.bodies]
        )

    def matrix(
        self, displacements: Array, ahead: Array | None = None, time: float = 0.0
    ) -> csr_array:
        """K, (d n, d n) [N/m], at displacements u = x - X (n, d) of all particles.

        Rows and columns include ghosts. Loads are those of `time` [s].
        """
        A = self.moduli(displacements, ahead)
        parts = [
            part.matrix(constant, A[part.body.extent])
            for part, constant in zip(self.bodies, self._constant(), strict=True)
        ]
        total = parts[0] if len(parts) == 1 else csr_array(block_diag(parts, format="csr"))
        of_loads = self.of_loads(displacements, time)
        return total if of_loads is None else csr_array(total + of_loads)

    def of_loads(self, displacements: Array, time: float) -> csr_array | None:
        """The part of K that loads add, (d n, d n) [N/m]; None if there is none."""
        added = [load.stiffness(displacements, time) for load in self.loads if is_stiff(load)]
        parts = [part for part in added if part is not None]
        return csr_array(sum(parts[1:], parts[0])) if parts else None

    def product(self, moduli: Array, motion: Array) -> Array:
        """K motion without the part of the loads, (n, d) [N], with these moduli."""
        n, d = motion.shape
        H = self.internal.gradients(motion).reshape(n, d * d, 1)
        return -self._forces(motion, (moduli.reshape(n, d * d, d * d) @ H).reshape(n, d, d))

    def ahead(self, displacements: Array, change: Array, placed: Array) -> Array:
        """Second Piola-Kirchhoff stress predicted by a step minus the actual one, (n, d, d) [Pa].

        Predicted is S + dS, linear in `change` (n, d) from `displacements` (n, d); actual is S at
        `placed` (n, d). The difference is of second order in the change.
        """
        fields = (
            self._deformation_gradients(displacements),
            self.internal.gradients(change),
            self._deformation_gradients(placed),
        )
        return np.concatenate(
            [part.ahead(*(field[part.body.extent] for field in fields)) for part in self.bodies]
        )

    def forces_ahead(self, displacements: Array, ahead: Array) -> Array:
        """Forces (n, d) [N] that a second Piola-Kirchhoff stress `ahead` (n, d, d) adds."""
        return self._forces(displacements, self._deformation_gradients(displacements) @ ahead)

    def _forces(self, displacements: Array, stresses: Array) -> Array:
        """Forces (n, d) of stresses (n, d, d) at real particles."""
        extended = [part.stress(stresses[part.body.extent]) for part in self.bodies]
        whole = np.ascontiguousarray(components_first(np.concatenate(extended)))
        return self.internal.spread(displacements, whole)

    def _constant(self) -> Sequence[Operators]:
        """The matrices of the sums of each body."""
        assert isinstance(self.internal, MatrixForces), "a matrix is formed from matrices"
        return self.internal.constant_operators()

    def _deformation_gradients(self, displacements: Array) -> Array:
        """Deformation gradients F, (n, d, d)."""
        F: Array = np.eye(displacements.shape[1]) + self.internal.gradients(displacements)
        return F


def tangent(simulation: BuiltScene, displacements: Array) -> csr_array:
    """K = -df/du, (d n, d n) [N/m], at displacements u = x - X (n, d) [m] of all particles.

    Component i of particle p has the index p d + i. Ghosts are included without their constraints.
    K is symmetric if the divergence is the adjoint of the gradient.

    Raises:
        SolidsphError: a formulation is not the total Lagrangian form.
    """
    return Tangent.of(simulation, sums_by_matrices(simulation)).matrix(displacements)


def is_symmetric(simulation: BuiltScene) -> bool:
    """Whether the internal forces derive from an energy, so that K is symmetric."""
    return all(body.formulation.divergence.adjoint for body in simulation.model.bodies)


def _moduli(body: Body, F: Array) -> Array:
    """Moduli dT_ik / dF_jl of all particles, (n, d, d, d, d) [Pa]; zero for ghosts."""
    n, d = F.shape[:2]
    moduli = np.empty((n, d, d, d, d))
    ghosts = body.particles.ghosts
    at = components_first(np.where(ghosts[:, None, None], np.eye(d), F))
    for j in range(d):
        for k in range(d):
            change = np.zeros((d, d))
            change[j, k] = 1.0
            dP = body.material.tangent(at, change, body.material.params)
            moduli[..., j, k] = particles_first(dP, n)
    moduli[ghosts] = 0.0
    return moduli


def _second_piola(body: Body, F: Array) -> Array:
    """Second Piola-Kirchhoff stress S = F^-1 P, (n, d, d) [Pa]."""
    P = body.material.first_piola(components_first(F), body.material.params)
    S = np.linalg.solve(F, particles_first(P, len(F)))
    return np.asarray(S, dtype=np.float64)


def _check_form(formulation: Formulation, d: int) -> None:
    """Raise SolidsphError unless F = I + H and T = P in the reference configuration."""
    name = type(formulation).__name__
    if formulation.configuration is not Configuration.REFERENCE:
        raise SolidsphError(
            f"statics: formulation {name} uses sums in the current configuration, whose operators "
            "depend on the displacements; use 'total-lagrangian'"
        )
    random = np.random.default_rng(0)
    H, P = random.uniform(-0.1, 0.1, (2, d, d))
    F = np.eye(d) + H
    values = np.array([formulation.deformation_gradient(H), formulation.flux(F, P)])
    if not np.allclose(values, [F, P], rtol=1e-14, atol=1e-14):
        raise SolidsphError(
            f"statics: formulation {name} has a deformation gradient other than I + du/dX, or a "
            "flux other than P, whose derivative is unknown; use 'total-lagrangian'"
        )


def _stress_extension(
    body: Body, simulation: BuiltScene, conditions: Sequence[StressTerm]
) -> csr_array | None:
    """Matrix that extends stresses of real particles to ghosts; None if it is not needed."""
    if not (conditions and body.formulation.divergence.uses_ghost_stress):
        return None
    d = simulation.particles.dimension
    total = simulation.particles.count
    real = ~body.particles.ghosts
    # Components of one particle are adjacent, as in the rows of the change of stress.
    inside = np.zeros((total, d, d), dtype=np.bool_)
    inside[body.extent][real] = True

    def imposed(values: Array) -> Array:
        stress = np.zeros((d, d, total))
        components = np.moveaxis(stress, -1, 0)
        components[inside] = values
        for condition in conditions:
            condition.impose_stress(0.0, stress)
        components[inside] -= values
        return components[body.extent].ravel()

    count = int(inside.sum())
    deviation = linear_part(imposed, count, [condition.label for condition in conditions])
    places = np.flatnonzero(inside[body.extent].ravel())
    size = d * d * body.particles.count
    embedding = csr_array(diags_array(np.ones(size), format="csr")[:, places])
    return csr_array(csr_array(embedding + deviation) @ embedding.T)
