"""Artificial viscosity, which gives shocks a width that the particles resolve."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import PairLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.pair_table import PairTable
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array, Indices, Scalar, Vector
from solidsph.maths.tensors import dot
from solidsph.registry.parameters import number
from solidsph_builtin.effects._gradients import in_the_reference, real_pairs

# Keeps the approach rate of meeting particles finite; relative to the squared initial distance.
_SOFTENING = 1e-4

# Approach rate of neighbours, over the wave speed, for which the step is stable: a velocity jump of
# the wave speed itself is spread over about three spacings.
_APPROACH = 1.0 / 3.0


@final
@attrs.frozen
class ArtificialViscosity(Effect):
    """Viscous repulsion between neighbours that approach each other, Monaghan & Gingold (1983).

    With s the particle spacing, c the confined wave speed and the pair's approach
    m = s v_ab . x_ab / |x_ab|^2, taken as 0 where it is positive,

        f_a = - sum over b of V_a V_b rho_0 |W'(X_ab)| (-linear c m + quadratic m^2) x_ab / |x_ab|,

    with the kernel at the reference distance, as in total Lagrangian sums, and the force along the
    current direction of the pair: momentum and angular momentum are conserved to rounding, and
    energy is only dissipated. Lengths are in spacings, not in supports, so that a uniform
    compression at the rate k meets the pressure rho_0 (linear c s k + quadratic s^2 k^2) / 2 in
    every dimension and with every kernel.
    """

    conserves_momentum: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.SHOCKS})

    linear: float = number(default=1.0)  # [-]
    quadratic: float = number(default=2.0)  # [-]

    def __attrs_post_init__(self) -> None:
        for name in ("linear", "quadratic"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise SceneError(
                    f"artificial-viscosity: {name} must be finite and not negative, got {value}; "
                    "near 1 is usual"
                )
        if self.linear == self.quadratic == 0.0:
            raise SceneError("artificial-viscosity: both strengths are 0; leave the effect out")

    def bind(self, model: DiscreteModel, label: str) -> Load:
        in_the_reference(model, "artificial-viscosity")
        rows, columns, values = zip(*(self._pairs(body) for body in model.bodies), strict=True)
        table = PairTable.of(
            np.concatenate(rows),
            np.concatenate(columns),
            np.concatenate(values),
            model.particles.count,
        )
        return _Viscosity(label, table, damping_rate=max(self._rate(b) for b in model.bodies))

    def _pairs(self, body: Body) -> tuple[Indices, Indices, Array]:
        """Pairs of a body among all particles, (m,) and (m,), and their values (m, 3).

        The values are both coefficients over |x_ab| [kg/s], [kg], and the softening [m^2].
        """
        pairs, particles = body.pairs(), body.particles
        acts = np.flatnonzero(real_pairs(body, pairs))
        a, b, R = pairs.rows[acts], pairs.columns[acts], pairs.distances[acts]
        V, spacing = particles.volumes, 0.5 * (particles.spacings[a] + particles.spacings[b])
        slopes = np.abs(body.smoothing.slope(R, body.smoothing.between(a, b)))
        weight = V[a] * V[b] * body.material.density * slopes
        values = [
            self.linear * body.material.wave_speed * spacing * weight,
            self.quadratic * spacing**2 * weight,
            _SOFTENING * R**2,
        ]
        first = body.extent.start
        return a + first, b + first, np.column_stack(values)

    def _rate(self, body: Body) -> float:
        """Damping rate of two neighbours in opposite motion [1/s]."""
        pairs, particles = body.pairs(), body.particles
        apart = pairs.distances > 0.0
        rates = np.zeros(pairs.count)
        R, a, b = pairs.distances[apart], pairs.rows[apart], pairs.columns[apart]
        slopes = np.abs(body.smoothing.slope(R, body.smoothing.between(a, b)))
        spacing = 0.5 * (particles.spacings[a] + particles.spacings[b])
        rates[apart] = particles.volumes[b] * spacing * slopes / R
        strength = self.linear + _APPROACH * self.quadratic
        return 2.0 * strength * body.material.wave_speed * float(pairs.row_sums(rates).max())

    def pair_work(self, particles: float, pairs: float) -> float:
        return pairs - particles


@final
@attrs.frozen(eq=False)
class _Viscosity(PairLoad):
    label: str
    pairs: PairTable
    damping_rate: float

    @staticmethod
    def pull(offset: Vector, velocity: Vector, values: Vector) -> Scalar:
        nearness = 1.0 / np.sqrt(dot(offset, offset) + values[2])
        approach = np.minimum(dot(velocity, offset), 0.0) * nearness * nearness
        return (values[0] - values[1] * approach) * approach * nearness
