"""Tangent stiffness: minus the derivative of the forces by the displacements."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array

from solidsph.engines.matrix import MatrixForces, Operators
from solidsph.errors import SolidsphError
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.terms import Load, StressTerm
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.filtered_tangent import Coupling, add_filter
from solidsph.statics.increment import AT_REST, Increment
from solidsph.statics.lead import Lead
from solidsph.statics.linear_part import linear_part
from solidsph.statics.local_law import LocalLaw, local_law
from solidsph.statics.stiff import is_stiff, is_stiff_in_steps
from solidsph.statics.sums import sums_by_matrices

# A linear prediction of a volume is trusted up to this ratio to the actual one.
_MOST_GROWTH = 2.0


@attrs.frozen(eq=False)
class Moduli:
    """dT_ik / dF_jl of all particles: the part of each alone, and what couples them."""

    local: Array  # (n, d, d, d, d) [Pa]
    couplings: Sequence[tuple[slice, Coupling]] = ()  # with the particles of the body

    def times(self, dF: Array) -> Array:
        """dT (n, d, d) [Pa] of dF (n, d, d)."""
        n, d = dF.shape[:2]
        local = self.local.reshape(n, d * d, d * d)
        changes = (local @ dF.reshape(n, d * d, 1)).reshape(n, d, d)
        for extent, coupling in self.couplings:
            changes[extent] += coupling.change(dF[extent])
        return changes

    def of(self, extent: slice) -> Moduli:
        """Those of the particles of one body."""
        couplings = [coupling for own, coupling in self.couplings if own == extent]
        own = slice(0, extent.stop - extent.start)
        return Moduli(self.local[extent], [(own, coupling) for coupling in couplings])

    @cached_property
    def alone(self) -> Array:
        """About the moduli of every particle alone, (n, d, d, d, d) [Pa]."""
        if not self.couplings:
            return self.local
        alone = self.local.copy()
        for extent, coupling in self.couplings:
            alone[extent] += coupling.alone
        return alone


@attrs.frozen(eq=False)
class _BodyTangent:
    """What the tangent of one body needs besides its sums."""

    body: Body
    law: LocalLaw
    stresses: csr_array | None  # (d d n, d d n) extends stresses of real particles to ghosts

    def moduli(self, F: Array, lead: Lead | None) -> Moduli:
        """dT/dF of all particles at F (n, d, d)."""
        F = self._real(F)
        leads = lead is not None and self._leads
        stretched = F * lead.stretch[:, None, None] if lead is not None and leads else F
        A, couplings = self.law.moduli(stretched), []
        added = self.body.dilatation_filter
        if added is not None:
            couplings.append((slice(0, len(F)), add_filter(added, stretched, A)))
        if lead is not None and leads:
            S = lead.stress + self._second_piola(F) - self._second_piola(stretched)
            A += np.einsum("ij,pkl->pikjl", np.eye(F.shape[1]), S)
        A[self.body.particles.ghosts] = 0.0
        return Moduli(A, couplings)

    def matrix(self, constant: Operators, moduli: Moduli) -> csr_array:
        """(d n, d n) [N/m]."""
        ghosts = self.body.particles.ghosts
        nothing_on_them = self.body.formulation.divergence.uses_ghost_stress
        left_out = ghosts if nothing_on_them else None
        if self.stresses is None and not moduli.couplings:
            return csr_array(constant.stiffness(moduli.local, left_out))
        changes: Any = constant.stress_changes(moduli.local)
        if moduli.couplings:
            gradients = constant.stress_changes(_itself(moduli.local))
            changes = csr_array(changes)
            for _, coupling in moduli.couplings:
                changes = changes + coupling.matrix(gradients)
        return csr_array(-(constant.of_stresses(left_out) @ self._extended(changes)))

    def stress(self, stresses: Array) -> Array:
        """Stresses (n, d, d) at real particles, extended to ghosts."""
        real = np.where(self.body.particles.ghosts[:, None, None], 0.0, stresses)
        extended: Array = self._extended(real.ravel()).reshape(stresses.shape)
        return extended

    def lead(self, before: Array, dF: Array, after: Array) -> Lead:
        """`Tangent.lead` from F before (n, d, d), its linear change and F after the step."""
        n, d = before.shape[:2]
        ghosts = self.body.particles.ghosts
        if not self._leads:
            return Lead(np.zeros((n, d, d)), np.ones(n))
        before, after = self._real(before), self._real(after)
        S = self._second_piola(before)
        predicted = S + np.linalg.solve(before, self._change(before, dF) - dF @ S)
        stress = predicted - self._second_piola(after)
        growth = 1.0 + np.trace(np.linalg.solve(before, dF), axis1=1, axis2=2)
        volumes = growth * np.linalg.det(before) / np.linalg.det(after)
        stretch = np.clip(volumes, 1.0 / _MOST_GROWTH, _MOST_GROWTH) ** (1.0 / d)
        stress[ghosts], stretch[ghosts] = 0.0, 1.0
        return Lead(stress, stretch)

    @property
    def _leads(self) -> bool:
        """Whether a linear prediction of the stress is better than the actual one.

        Linear forces have no geometric stiffness; and beyond first yield the prediction is far from
        what a metal bears.
        """
        return self.body.material.objective and self.law.smooth

    def _second_piola(self, F: Array) -> Array:
        """Second Piola-Kirchhoff stress S = F^-1 P, (n, d, d) [Pa]."""
        P, added = self.law.stress(F), self.body.dilatation_filter
        if added is not None:
            P = P + added.stress(F)
        return np.asarray(np.linalg.solve(F, P), dtype=np.float64)

    def _change(self, F: Array, dF: Array) -> Array:
        """dP (n, d, d) [Pa] of dF (n, d, d)."""
        dP, added = self.law.change(F, dF), self.body.dilatation_filter
        return dP if added is None else dP + added.change(F, dF)

    def _real(self, F: Array) -> Array:
        """F (n, d, d) with that of ghosts replaced by the identity."""
        real: Array = np.where(self.body.particles.ghosts[:, None, None], np.eye(F.shape[1]), F)
        return real

    def _extended(self, stresses: Any) -> Any:
        """Stresses of real particles, or their derivative, extended to ghosts."""
        return stresses if self.stresses is None else self.stresses @ stresses


def _itself(moduli: Array) -> Array:
    """Moduli (n, d, d, d, d) that give a gradient itself."""
    d = moduli.shape[1]
    return np.broadcast_to(np.einsum("ij,kl->ikjl", np.eye(d), np.eye(d)), moduli.shape)


@attrs.frozen(eq=False)
class Tangent:
    """Tangent of a scene, by the sums of its internal forces."""

    bodies: Sequence[_BodyTangent]
    internal: InternalForces  # the sums, in double precision
    loads: Sequence[Load]
    increment: Increment = AT_REST  # the load step

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
                _BodyTangent(
                    body,
                    local_law(body, internal),
                    _stress_extension(body, simulation, conditions),
                )
                for body in bodies
            ],
            internal,
            simulation.dynamics.loads,
        )

    def during(self, increment: Increment) -> Tangent:
        """The tangent in a load step, of the forces at its end."""
        bodies = [attrs.evolve(b, law=b.law.during(increment)) for b in self.bodies]
        return attrs.evolve(self, bodies=bodies, increment=increment)

    def moduli(self, displacements: Array, lead: Lead | None = None) -> Moduli:
        """dT/dF of all particles at displacements (n, d).

        With a lead the volume and the stress are those that the last step predicted.
        """
        F = self._deformation_gradients(displacements)
        parts = []
        for part in self.bodies:
            extent = part.body.extent
            parts.append(part.moduli(F[extent], None if lead is None else lead.of(extent)))
        couplings = [
            (body.body.extent, coupling)
            for body, part in zip(self.bodies, parts, strict=True)
            for _, coupling in part.couplings
        ]
        return Moduli(np.concatenate([part.local for part in parts]), couplings)

    def matrix(self, displacements: Array, lead: Lead | None = None) -> csr_array:
        """K, (d n, d n) [N/m], at displacements u = x - X (n, d) of all particles.

        Rows and columns include ghosts.
        """
        return self.assembled(self.moduli(displacements, lead), self.of_loads(displacements))

    def assembled(self, moduli: Moduli, of_loads: csr_array | None) -> csr_array:
        """K, (d n, d n) [N/m], with these moduli and this part of the loads."""
        parts = [
            part.matrix(constant, moduli.of(part.body.extent))
            for part, constant in zip(self.bodies, self._constant(), strict=True)
        ]
        total = parts[0] if len(parts) == 1 else csr_array(block_diag(parts, format="csr"))
        return total if of_loads is None else csr_array(total + of_loads)

    def of_loads(self, displacements: Array) -> csr_array | None:
        """The part of K that loads add, (d n, d n) [N/m]; None if there is none."""
        added = [self._of_load(load, displacements) for load in self.loads]
        parts = [part for part in added if part is not None]
        return csr_array(sum(parts[1:], parts[0])) if parts else None

    def _of_load(self, load: Load, displacements: Array) -> csr_array | None:
        own: object = load
        now = self.increment
        if is_stiff_in_steps(own):
            velocities = now.velocities(load, displacements)
            return own.stiffness_of_step(now.time, now.step, displacements, velocities, now.memory)
        return own.stiffness(displacements, now.time) if is_stiff(own) else None

    def product(self, moduli: Moduli, motion: Array) -> Array:
        """K motion without the part of the loads, (n, d) [N], with these moduli."""
        return -self._forces(motion, moduli.times(self.internal.gradients(motion)))

    def own_stiffness(self, moduli: Array) -> Array:
        """Blocks of K at each particle without the part of the loads, (n, d, d) [N/m]."""
        n, d = moduli.shape[:2]
        blocks = self.internal.own_stiffness(moduli.reshape(n, d * d, d * d))
        assert blocks is not None, "sums are chosen that can tell"
        return blocks

    def lead(self, displacements: Array, change: Array, placed: Array) -> Lead:
        """Stress and volume predicted by a step, beside the actual ones.

        Predicted are S + dS and J + dJ, linear in `change` (n, d) from `displacements` (n, d);
        actual are those at `placed` (n, d). The difference is of second order in the change.
        """
        fields = (
            self._deformation_gradients(displacements),
            self.internal.gradients(change),
            self._deformation_gradients(placed),
        )
        leads = [part.lead(*(field[part.body.extent] for field in fields)) for part in self.bodies]
        return Lead(
            np.concatenate([lead.stress for lead in leads]),
            np.concatenate([lead.stretch for lead in leads]),
        )

    def forces_ahead(self, displacements: Array, lead: Lead) -> Array:
        """Forces (n, d) [N] that the stress of a lead adds."""
        F = self._deformation_gradients(displacements)
        return self._forces(displacements, F @ lead.stress)

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
