"""Hourglass control: a penalty on motions that the gradient does not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.hourglass import hourglass_operator
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import HourglassLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassPairs
from solidsph.interfaces.terms import EnergyTerm, FieldTerm, Load, Observation
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.effects._gradients import in_the_reference, real_pairs

# Smallest weight of a pair, relative to that of particles one spacing apart. On lattices with a
# cover near 3 this leaves the 2, 8 or 26 nearest neighbours, with 98 % of the sum of all weights.
_SMALLEST_WEIGHT = 0.02

# Strain that rounding may give a rigid motion.
_AT_REST = 1e-10


@final
@attrs.frozen
class HourglassControl(Effect):
    """A penalty on the part of a neighbour's offset that the deformation gradients do not explain.

    With e_ab = (F_a + F_b)/2 X_ab - x_ab, Ganzenmueller (2015), the energy

        1/4 sum over a, b of strength mu V_a V_b W(X_ab) |e_ab|^2 / |X_ab|^2

    over the nearest neighbours vanishes for every linear motion, rigid ones included, and, where
    the gradient is exact for them, for every quadratic one; its exact derivative is the force.
    The usual form projects e_ab on the current direction of the pair, and has no energy. Since F
    is linear in the displacements so is e_ab, and the force is a constant matrix times them.

    The scale is mu, since motions that the gradient does not see are like shear: the slowest has a
    measured frequency of about sqrt(strength) times shear speed over spacing, for any kernel,
    gradient and Poisson's ratio, while a tenth of lambda + 2 mu stiffens a beam of nu = 0.4999 by
    6 to 80 per cent. The default is the smallest strength with which a column thrown to the side
    stays smooth in every scheme tried; it changes the deflection of that beam, 5 particles across,
    by 0.1 to 0.6 per cent, and the stable step by less than one (docs/hourglass.md has the tables).
    """

    conserves_momentum: ClassVar[bool] = True
    uses_initial_pairs: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.UNSEEN_MOTIONS})

    strength: float = number(default=0.5)  # [-] times the shear modulus

    def __attrs_post_init__(self) -> None:
        check_positive("hourglass-control", "strength", self.strength, "times mu, near 0.5")

    def bind(self, model: DiscreteModel, label: str) -> Load:
        in_the_reference(model, "hourglass-control")
        return _Control(
            label=label,
            reference=model.particles.positions,
            operators=[hourglass_operator(penalised(body, self.strength)) for body in model.bodies],
        )

    def pair_work(self, particles: float, pairs: float) -> float:
        # All pairs for H and for the stress, and in between the nearest, up to 26 on a lattice.
        return 2.0 * pairs + min(pairs, 26.0 * particles)


def penalised(body: Body, strength: float) -> HourglassPairs:
    """Near pairs with c_ab = strength mu V_a V_b W(X_ab) / |X_ab|^2, without ghosts."""
    particles = body.particles
    pairs = body.pairs(_reach(body))
    apart = real_pairs(body, pairs)
    weights = np.zeros(pairs.count)
    r, a, b = pairs.distances[apart], pairs.rows[apart], pairs.columns[apart]
    _, mu = body.material.lame_parameters
    V = particles.volumes
    W = body.smoothing.value(r, body.smoothing.between(a, b))
    weights[apart] = strength * mu * (V[a] * V[b]) * W / r**2
    return HourglassPairs.of(body, pairs, weights)


def _reach(body: Body) -> float:
    """Distance beyond which weights are negligible [m]."""
    spacing, support = float(body.particles.spacings.max()), body.smoothing.support_radius
    r = np.linspace(spacing, support, 1001)
    weights = body.smoothing.value(r) / r**2
    return float(r[np.flatnonzero(weights >= _SMALLEST_WEIGHT * weights[0])[-1]])


@final
@attrs.frozen(eq=False)
class _Control(HourglassLoad, FieldTerm, EnergyTerm):
    label: str
    reference: Array  # (n, d)
    operators: Sequence[HourglassOperator]

    def energies(self, observation: Observation) -> Array:
        """Energy of the penalty per particle, (n,) [J]: half of that of each of its pairs."""
        if self not in observation.made:
            observation.made[self] = self._energies(observation)
        found: Array = observation.made[self]
        return found

    def _energies(self, observation: Observation) -> Array:
        u = observation.state.positions - self.reference
        H = observation.deformation_gradients - np.eye(u.shape[1])
        squares = [
            operator.pairs.squares(u[operator.pairs.body.extent], H[operator.pairs.body.extent])
            for operator in self.operators
        ]
        return 0.25 * np.concatenate(squares)

    def report(self, observation: Observation) -> Mapping[str, float]:
        strain = float(observation.particles.volumes @ observation.energy_densities)
        own = float(self.energies(observation).sum())
        return {
            f"{self.label} energy [J]": own,
            # Above some per cent, motions that the gradient does not see affect the result.
            f"{self.label} share [-]": own / (own + strain) if own + strain > 0.0 else 0.0,
        }

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        """Error and share, which show where motions matter that the gradient does not see.

        The error is the strain that F misses, the mean of |e_ab| / |X_ab| over neighbours, to be
        compared with the strains of the problem; it hardly depends on the strength.

        The share is the penalty's fraction of a particle's energy: near 1 for a motion that the
        gradient does not see, near 0 for a resolved one, for any load. The strain energy counts as
        at least its mean over the body, since an almost unstrained end would otherwise show the
        ratio of two small numbers.
        """
        own = self.energies(observation)
        share, error = np.zeros_like(own), np.zeros_like(own)
        V = np.where(observation.particles.ghosts, 0.0, observation.particles.volumes)
        for pairs in (operator.pairs for operator in self.operators):
            extent = pairs.body.extent
            density, volumes = observation.energy_densities[extent], V[extent]
            strain = volumes * np.maximum(density, volumes @ density / volumes.sum())
            near = pairs.moments > 0.0
            # The root of the weighted mean of squares.
            error[extent][near] = np.sqrt(4.0 * own[extent][near] / pairs.moments[near])
            moving = error[extent] > _AT_REST
            share[extent][moving] = own[extent][moving] / (own[extent] + strain)[moving]
        return {f"{self.label} share [-]": share, f"{self.label} error [-]": error}
