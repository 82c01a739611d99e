"""Control of motions that the gradient does not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import final

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array, kron

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.errors import SceneError
from solidsph.interfaces.condition import ForceCondition, Observation
from solidsph.interfaces.declared import LinearForce
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Configuration
from solidsph.parameters import check_positive, number
from solidsph.setting import Setting


@final
@attrs.frozen
class HourglassControl(Effect):
    """Penalises what remains of a neighbour's offset after both deformation gradients.

    With e_ab = (F_a + F_b)/2 X_ab - x_ab, Ganzenmueller (2015), the energy

        1/4 sum over a, b of strength M V_a V_b W(X_ab) |e_ab|^2 / |X_ab|^2,   M = lambda + 2 mu,

    vanishes for every linear motion, rigid ones included, and its exact derivative is the force.
    The usual form projects e_ab on the current direction of the pair, and has no energy. Since F
    is linear in the displacements so is e_ab, and the force is a constant matrix times them.
    """

    strength: float = number(default=0.1)  # [-]

    def __attrs_post_init__(self) -> None:
        check_positive("hourglass-control", "strength", self.strength, "times a modulus, near 0.1")

    def bind(self, setting: Setting, label: str) -> ForceCondition:
        for body in setting.bodies:
            if body.formulation.configuration is not Configuration.REFERENCE:
                raise SceneError(
                    "hourglass-control: it is written in the reference configuration, but the "
                    f"formulation of body {body.name!r} follows the motion; use 'total-lagrangian'"
                )
        blocks = [self.strength * _penalty(body) for body in setting.bodies]
        return _Penalty(
            label=label,
            reference=setting.particles.positions,
            matrix=csr_array(block_diag(blocks, format="csr")),
        )

    def arrays(self, setting: Setting) -> Mapping[str, int]:
        # Neighbours of neighbours: about 2^d times a particle's pairs, 12 bytes each.
        pairs = sum(body.pairs().count for body in setting.bodies)
        return {"stiffness": 12 * 2**setting.particles.dimension * pairs}

    def damping_rate(self) -> float:
        return 0.0

    def stiffness_rate(self, bodies: Sequence[Body]) -> float:
        # Two neighbours in opposite motion: 4 strength c^2 sum of V_b W / r^2.
        rates = []
        for body in bodies:
            pairs = body.pairs()
            apart = pairs.distances > 0.0
            terms = np.zeros(pairs.count)
            r = pairs.distances[apart]
            V = body.particles.volumes[pairs.columns[apart]]
            terms[apart] = V * body.smoothing.value(r) / r**2
            worst = float(pairs.row_sums(terms).max())
            rates.append(2.0 * body.material.wave_speed * sqrt(self.strength * worst))
        return max(rates)


def _penalty(body: Body) -> csr_array:
    """Matrix K (n, n) of the energy u K u / 2 of each component, for strength 1 [N/m]."""
    pairs, particles = body.pairs(), body.particles
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    gradient = body.formulation.gradient.weights(pairs, kernel_gradients, particles.cells)
    real = ~particles.ghosts
    chosen = np.flatnonzero((pairs.distances > 0.0) & real[pairs.rows] & real[pairs.columns])
    a, b, X = pairs.rows[chosen], pairs.columns[chosen], pairs.offsets[chosen]
    count, n = len(chosen), pairs.row_count
    number_of = np.arange(count)
    ones = np.ones(count)
    take_a = csr_array((ones, (number_of, a)), shape=(count, n))
    take_b = csr_array((ones, (number_of, b)), shape=(count, n))
    # e_ab is linear in the displacements: the mean of both gradients along the offset, less the
    # difference; the identity in F cancels the reference offset.
    errors = take_a - take_b
    for axis in range(X.shape[1]):
        along = pairs.matrix(gradient[:, axis])
        errors = errors + diags_array(0.5 * X[:, axis]) @ ((take_a + take_b) @ along)
    lam, mu = body.material.lame_parameters
    V, r = particles.volumes, pairs.distances[chosen]
    weights = 0.5 * (lam + 2.0 * mu) * V[a] * V[b] * body.smoothing.value(r) / r**2
    return csr_array(errors.T @ diags_array(weights) @ errors)


@final
@attrs.frozen(eq=False)
class _Penalty(LinearForce):
    label: str
    reference: Array  # (n, d)
    matrix: csr_array  # (n, n), the same for every component

    def stiffness(self, displacements: Array) -> csr_array:
        """Minus the derivative of the force, (d n, d n), particle by particle."""
        return csr_array(kron(self.matrix, np.eye(displacements.shape[1]), format="csr"))

    def energy(self, positions: Array) -> float:
        """The penalty's energy [J]."""
        u = positions - self.reference
        return 0.5 * float(np.vdot(u, self.matrix @ u))

    def report(self, observation: Observation) -> Mapping[str, float]:
        strain = float(observation.particles.volumes @ observation.energy_densities)
        own = self.energy(observation.state.positions)
        return {
            f"{self.label} energy [J]": own,
            # Beyond some per cent, motions that the gradient does not see matter to the answer.
            f"{self.label} share [-]": own / (own + strain) if own + strain > 0.0 else 0.0,
        }
