"""Control of motions that the gradient does not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import sqrt
from typing import final
from weakref import WeakKeyDictionary

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, kron
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.arrays import Array, Indices
from solidsph.body import Body
from solidsph.errors import SceneError
from solidsph.interfaces.condition import FieldCondition, ForceCondition, Observation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Configuration
from solidsph.parameters import check_positive, number
from solidsph.setting import Setting
from solidsph.smoothing import UNIT_SPHERE
from solidsph_builtin.effects._penalty import Penalty, PenaltyProducts

# Compiling the sweeps takes some 10 s once a process, and products some 30 ns a pair more than they
# do: from here on it pays within about a thousand steps.
_MANY_PAIRS = 300_000

# Strain that rounding may leave of a rigid motion.
_AT_REST = 1e-10

# Of the penalty's largest eigenvalue, the square of a frequency.
_TOLERANCE = 0.02

# Up to this size a dense matrix is as cheap.
_SMALL = 40


@final
@attrs.frozen
class HourglassControl(Effect):
    """Penalises what remains of a neighbour's offset after both deformation gradients.

    With e_ab = (F_a + F_b)/2 X_ab - x_ab, Ganzenmueller (2015), the energy

        1/4 sum over a, b of strength mu V_a V_b W(X_ab) |e_ab|^2 / |X_ab|^2

    over the nearest neighbours vanishes for every linear motion, rigid ones included, and, where
    the gradient is exact for them, for every quadratic one; its exact derivative is the force.
    The usual form projects e_ab on the current direction of the pair, and has no energy. Since F
    is linear in the displacements so is e_ab, and the force is a constant matrix times them.

    The scale is mu, since what the gradient does not see moves like shear: measured, the slowest
    such motion has about sqrt(strength) times shear speed over spacing, whatever the kernel, the
    gradient and Poisson's ratio, while a tenth of lambda + 2 mu stiffens a beam of nu = 0.4999 by
    6 to 80 per cent. The default is the smallest strength with which a column thrown to the side
    stays smooth in every scheme tried; it changes that beam's deflection, 5 particles across, by
    0.1 to 0.6 per cent, and the stable step by less than one (docs/hourglass.md has the tables).

    Each particle's share is recorded as a field, and as a number for the whole body.
    """

    strength: float = number(default=0.5)  # [-] times the shear modulus

    def __attrs_post_init__(self) -> None:
        check_positive("hourglass-control", "strength", self.strength, "times mu, near 0.5")

    def bind(self, setting: Setting, label: str) -> ForceCondition:
        for body in setting.bodies:
            if body.formulation.configuration is not Configuration.REFERENCE:
                raise SceneError(
                    "hourglass-control: it is written in the reference configuration, but the "
                    f"formulation of body {body.name!r} follows the motion; use 'total-lagrangian'"
                )
        return _Control(
            label=label,
            particles=np.arange(setting.particles.count),
            reference=setting.particles.positions,
            parts=[(body.extent, _penalty(body, self.strength)) for body in setting.bodies],
        )

    def arrays(self, setting: Setting) -> Mapping[str, int]:
        return {
            f"penalty of {body.name}": _penalty(body, self.strength).bytes
            for body in setting.bodies
        }

    def damping_rate(self) -> float:
        return 0.0

    def stiffness_rate(self, bodies: Sequence[Body]) -> float:
        return max(
            _highest_frequency(_penalty(body, self.strength), body.masses, body.smoothing.dimension)
            for body in bodies
        )


# The step is chosen before the term is bound: what is made for one serves the other.
_MADE: WeakKeyDictionary[Body, dict[float, Penalty]] = WeakKeyDictionary()


def _penalty(body: Body, strength: float) -> Penalty:
    made = _MADE.setdefault(body, {})
    if strength not in made:
        made[strength] = _new_penalty(body, strength)
    return made[strength]


def _new_penalty(body: Body, strength: float) -> Penalty:
    # Pairs that there would be if every support were complete.
    d = body.smoothing.dimension
    ball = UNIT_SPHERE[d] / d * body.smoothing.support_radius**d
    if body.particles.count * ball / np.mean(body.particles.volumes) < _MANY_PAIRS:
        return PenaltyProducts.of(body, strength)
    from solidsph_builtin.effects._penalty_sweeps import PenaltySweeps  # brings the compiler

    return PenaltySweeps.of(body, strength)


def _highest_frequency(penalty: Penalty, masses: Array, dimension: int) -> float:
    """At most by `_TOLERANCE` above the largest angular frequency of the penalty alone [rad/s].

    By Lanczos' iteration. A bound from sums of weights alone would miss gradients that lean on
    small differences of large weights, as a quadratic fit to few neighbours may.
    """
    moving = np.flatnonzero(masses > 0.0)
    scaling = 1.0 / np.sqrt(masses[moving])[:, None]
    u = np.zeros((len(masses), dimension))

    def product(direction: Array) -> Array:
        u[moving] = scaling * direction.reshape(-1, dimension)
        forces: Array = scaling * penalty.forces(u)[moving]
        return -forces.ravel()

    size = dimension * len(moving)
    if size <= _SMALL:
        squares = np.linalg.eigvalsh(np.stack([product(row) for row in np.eye(size)]))
    else:
        squares = eigsh(
            LinearOperator((size, size), matvec=product, dtype=np.float64),
            k=1,
            which="LA",
            tol=_TOLERANCE,
            v0=np.random.default_rng(0).standard_normal(size),
            return_eigenvectors=False,
        )
    # The residual of the vector found bounds the error of its value by the tolerance.
    return sqrt(max(0.0, float(squares.max())) * (1.0 + _TOLERANCE))


@final
@attrs.frozen(eq=False)
class _Control(ForceCondition, FieldCondition):
    label: str
    particles: Indices  # (n,)
    reference: Array  # (n, d)
    parts: Sequence[tuple[slice, Penalty]]  # of every body

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        u = positions - self.reference
        forces = np.empty_like(u)
        for extent, penalty in self.parts:
            forces[extent] = penalty.forces(u[extent])
        return forces

    @cached_property
    def matrix(self) -> csr_array:
        """K (n, n) [N/m]: the force is -K u in every component."""
        return csr_array(block_diag([part.matrix() for _, part in self.parts], format="csr"))

    def stiffness(self, displacements: Array) -> csr_array:
        """Minus the derivative of the force, (d n, d n), particle by particle."""
        return csr_array(kron(self.matrix, np.eye(displacements.shape[1]), format="csr"))

    def energies(self, positions: Array) -> Array:
        """The penalty's energy, particle by particle, (n,) [J]: half of each pair's."""
        u = positions - self.reference
        return np.concatenate([0.25 * part.squares(u[extent]) for extent, part in self.parts])

    def energy(self, positions: Array) -> float:
        """The penalty's energy [J]."""
        return float(self.energies(positions).sum())

    def report(self, observation: Observation) -> Mapping[str, float]:
        strain = float(observation.particles.volumes @ observation.energy_densities)
        own = self.energy(observation.state.positions)
        return {
            f"{self.label} energy [J]": own,
            # Beyond some per cent, motions that the gradient does not see matter to the answer.
            f"{self.label} share [-]": own / (own + strain) if own + strain > 0.0 else 0.0,
        }

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        """Where, and how far, motions that the gradient does not see matter.

        The error is the strain that F misses, the mean of |e_ab| / |X_ab| over neighbours: to be
        held against the strains of the problem, and almost independent of the strength.

        The share is the penalty's part of a particle's energy: near 1 where the motion is one that
        the gradient does not see, near 0 where it is resolved, whatever the size of the load. The
        strain energy counts as at least its mean over the body: an end that is next to unstrained
        would show the ratio of two small numbers, and hide where the answer suffers.
        """
        own = self.energies(observation.state.positions)
        share, error = np.zeros_like(own), np.zeros_like(own)
        V = np.where(observation.particles.ghosts, 0.0, observation.particles.volumes)
        for extent, part in self.parts:
            density, volumes = observation.energy_densities[extent], V[extent]
            strain = volumes * np.maximum(density, volumes @ density / volumes.sum())
            near = part.moments > 0.0
            # The root of the weighted mean of squares.
            error[extent][near] = np.sqrt(4.0 * own[extent][near] / part.moments[near])
            moving = error[extent] > _AT_REST
            share[extent][moving] = own[extent][moving] / (own[extent] + strain)[moving]
        return {f"{self.label} share [-]": share, f"{self.label} error [-]": error}
