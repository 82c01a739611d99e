"""Viscosity that gives shocks a width that the particles resolve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import PairLoad, PairTable
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.terms import Load, Observation
from solidsph.maths.arrays import Scalar, Vector
from solidsph.maths.tensors import dot
from solidsph.registry.parameters import number

# Keeps the approach of two particles that meet finite, in squares of their first distance.
_SOFTENING = 1e-4

# Approach of neighbours, over the wave speed, for which the step is kept stable: a jump of velocity
# by the wave speed itself is spread over some three spacings.
_APPROACH = 1.0 / 3.0


@final
@attrs.frozen
class ArtificialViscosity(Effect):
    """Neighbours that approach each other push each other apart. Monaghan & Gingold (1983).

    With s the particle spacing, c the confined wave speed and the pair's approach
    m = s v_ab . x_ab / |x_ab|^2, taken as 0 where it is positive,

        f_a = - sum over b of V_a V_b rho_0 |W'(X_ab)| (-linear c m + quadratic m^2) x_ab / |x_ab|,

    with the kernel at the reference distance, as total Lagrangian sums have it, and the force
    along the pair as it is now: momentum and angular momentum are kept to rounding, and energy is
    only ever taken. Lengths are in spacings and not in supports, so that a uniform compression at
    the rate k meets the pressure rho_0 (linear c s k + quadratic s^2 k^2) / 2 in every dimension
    and with every kernel.
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
        for body in model.bodies:
            if body.formulation.configuration is not Configuration.REFERENCE:
                raise SceneError(
                    "artificial-viscosity: its pairs are those of the reference configuration, but "
                    f"the formulation of body {body.name!r} follows the motion; use "
                    "'total-lagrangian'"
                )
        tables = [self._table(body) for body in model.bodies]
        firsts = np.cumsum([0, *(len(table.columns) for table in tables)])
        return _Viscosity(
            label,
            PairTable(
                starts=np.concatenate(
                    [[0], *(t.starts[1:] + k for t, k in zip(tables, firsts[:-1], strict=True))]
                ).astype(np.intp),
                columns=np.concatenate(
                    [
                        t.columns + body.extent.start
                        for t, body in zip(tables, model.bodies, strict=True)
                    ]
                ).astype(np.int32),
                values=np.concatenate([table.values for table in tables]),
            ),
            damping_rate=max(self._rate(body) for body in model.bodies),
        )

    def _table(self, body: Body) -> PairTable:
        """Of a body's own pairs: both coefficients over |x_ab| [kg/s], [kg], softening [m^2]."""
        pairs, particles = body.pairs(), body.particles
        real = ~particles.ghosts
        acts = np.flatnonzero((pairs.distances > 0.0) & real[pairs.rows] & real[pairs.columns])
        a, b, R = pairs.rows[acts], pairs.columns[acts], pairs.distances[acts]
        V, spacing = particles.volumes, 0.5 * (particles.spacings[a] + particles.spacings[b])
        weight = V[a] * V[b] * body.material.density * np.abs(body.smoothing.slope(R))
        counts = np.bincount(a, minlength=particles.count)
        return PairTable(
            starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
            columns=b.astype(np.int32),
            values=np.column_stack(
                [
                    self.linear * body.material.wave_speed * spacing * weight,
                    self.quadratic * spacing**2 * weight,
                    _SOFTENING * R**2,
                ]
            ),
        )

    def _rate(self, body: Body) -> float:
        """Of two neighbours in opposite motion, both ways [1/s]."""
        pairs, particles = body.pairs(), body.particles
        apart = pairs.distances > 0.0
        rates = np.zeros(pairs.count)
        R, b = pairs.distances[apart], pairs.columns[apart]
        slopes = np.abs(body.smoothing.slope(R))
        rates[apart] = particles.volumes[b] * particles.spacings[b] * slopes / R
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
        square = dot(offset, offset)
        approach = np.minimum(dot(velocity, offset), 0.0) / (square + values[2])
        return (values[0] * approach - values[1] * approach**2) / np.sqrt(square + values[2])

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
