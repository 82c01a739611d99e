"""The tangent stiffness: minus the derivative of the forces by the displacements, sparse."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from scipy.sparse import block_diag, bsr_array, csr_array, diags_array

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.engines.matrix import Operators, operators
from solidsph.errors import SolidsphError
from solidsph.interfaces.condition import ForceCondition, StressCondition
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.simulation import Simulation
from solidsph.statics.linear_part import linear_part
from solidsph.statics.stiff import Stiff
from solidsph.tensors import components_first, particles_first


@attrs.frozen(eq=False)
class _BodyTangent:
    """K of one body, from its constant operators."""

    body: Body
    constant: Operators
    stresses: csr_array | None  # (d d n, d d n) of all particles from those of real ones

    def matrix(self, displacements: Array) -> csr_array:
        """(d n, d n) [N/m] at displacements (n, d) of the body."""
        n, d = displacements.shape
        gradients = [self.constant.gradient[k * n : (k + 1) * n] for k in range(d)]
        g = np.stack([block.data for block in gradients], axis=1)
        H = np.stack([block @ displacements for block in gradients], axis=2)
        A = _moduli(self.body, np.eye(d) + H)
        # Change of stress T_ik at p for a displacement of q along j, block by block (p, q).
        pattern = gradients[0]
        changes = np.einsum("mikjl,ml->mikj", np.repeat(A, np.diff(pattern.indptr), axis=0), g)
        of_displacement = bsr_array(
            (changes.reshape(-1, d * d, d), pattern.indices, pattern.indptr),
            shape=(d * d * n, d * n),
        )
        stress = of_displacement if self.stresses is None else self.stresses @ of_displacement
        return csr_array(-(self._force(n, d) @ stress))

    def _force(self, n: int, d: int) -> bsr_array:
        """Force along i at p from stress components (j, k) at q, (d n, d d n)."""
        blocks = [self.constant.force[:, k * n : (k + 1) * n] for k in range(d)]
        f = np.stack([block.data for block in blocks], axis=1)
        if self.body.formulation.divergence.uses_ghost_stress:  # nothing acts on ghosts then
            f[np.repeat(self.body.particles.ghosts, np.diff(blocks[0].indptr))] = 0.0
        weights = np.einsum("ij,mk->mijk", np.eye(d), f).reshape(-1, d, d * d)
        return bsr_array((weights, blocks[0].indices, blocks[0].indptr), shape=(d * n, d * d * n))


@attrs.frozen(eq=False)
class Tangent:
    """K of a scene; what does not change with the displacements is kept."""

    bodies: Sequence[_BodyTangent]
    loads: Sequence[ForceCondition]

    @classmethod
    def of(cls, simulation: Simulation) -> Tangent:
        """Prepare the tangent of a scene.

        Raises:
            SolidsphError: a formulation is not of the reference configuration, or its own.
        """
        bodies = simulation.setting.bodies
        for body in bodies:
            _check_form(body.formulation, simulation.particles.dimension)
        conditions = [c for c in simulation.conditions if isinstance(c, StressCondition)]
        return cls(
            [
                _BodyTangent(
                    body,
                    operators(body, body.pairs(), body.particles.volumes),
                    _stress_extension(body, simulation, conditions),
                )
                for body in bodies
            ],
            simulation.dynamics.loads,
        )

    def matrix(self, displacements: Array) -> csr_array:
        """K, (d n, d n) [N/m], at displacements u = x - X (n, d) of all particles.

        Forces on ghosts and their displacements are among its rows and columns.
        """
        parts = [part.matrix(displacements[part.body.extent]) for part in self.bodies]
        total = parts[0] if len(parts) == 1 else csr_array(block_diag(parts, format="csr"))
        for load in self.loads:
            if isinstance(load, Stiff):
                own = load.stiffness(displacements)
                total = total if own is None else csr_array(total + own)
        return total


def tangent(simulation: Simulation, displacements: Array) -> csr_array:
    """K = -df/du, (d n, d n) [N/m], at displacements u = x - X (n, d) [m] of all particles.

    Rows and columns stand particle by particle, component i of particle p at p d + i, ghosts
    included as they come from the engine: neither their forces nor their motion handed on. It is
    symmetric where the divergence is the gradient's adjoint.

    Raises:
        SolidsphError: a formulation is not of the reference configuration.
    """
    return Tangent.of(simulation).matrix(displacements)


def is_symmetric(simulation: Simulation) -> bool:
    """Whether the internal forces derive from an energy, so that K is symmetric."""
    return all(body.formulation.divergence.adjoint for body in simulation.setting.bodies)


def _moduli(body: Body, F: Array) -> Array:
    """dT_ik / dF_jl at every particle, (n, d, d, d, d) [Pa]; zero for ghosts, which have none."""
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


def _check_form(formulation: Formulation, d: int) -> None:
    """Raise SolidsphError unless F = I + H and T = P in the reference configuration."""
    name = type(formulation).__name__
    if formulation.configuration is not Configuration.REFERENCE:
        raise SolidsphError(
            f"statics: formulation {name} takes its sums in the current configuration, where the "
            "operators change with every displacement; take 'total-lagrangian'"
        )
    random = np.random.default_rng(0)
    H, P = random.uniform(-0.1, 0.1, (2, d, d))
    F = np.eye(d) + H
    own = np.array([formulation.deformation_gradient(H), formulation.flux(F, P)])
    if not np.allclose(own, [F, P], rtol=1e-14, atol=1e-14):
        raise SolidsphError(
            f"statics: formulation {name} has a deformation gradient other than I + du/dX, or a "
            "flux other than P, whose derivative is unknown; take 'total-lagrangian'"
        )


def _stress_extension(
    body: Body, simulation: Simulation, conditions: Sequence[StressCondition]
) -> csr_array | None:
    """How the stress of ghosts follows that of the body's real particles; None if it is unused."""
    if not (conditions and body.formulation.divergence.uses_ghost_stress):
        return None
    d = simulation.particles.dimension
    total = simulation.particles.count
    own = ~body.particles.ghosts
    # Components of one particle stand together, as in the rows of the change of stress.
    inside = np.zeros((total, d, d), dtype=np.bool_)
    inside[body.extent][own] = True

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
