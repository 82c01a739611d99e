"""Checks of a formulation, with its gradient and divergence, in 1, 2 and 3D.

The promises of a formulation follow from what its parts declare: a gradient exact for linear
fields represents rigid motions, a divergence that conserves momentum balances the forces of a free
body.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import attrs
import numpy as np

from solidsph.conformance.check import Kit, NotPromised
from solidsph.conformance.samples import (
    ANGLES,
    central_difference,
    random_deformation_gradients,
    rotation,
    seeded,
    stiffness,
)
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.maths.arrays import Array
from solidsph.simulation import Simulation
from solidsph.testing.bodies import SPACING, box, scene, smooth

_CELLS = {1: (12,), 2: (7, 6), 3: (5, 4, 4)}
_COVER = 3.5  # a particle in a corner has neighbours enough for second derivatives

# Sums of some hundred terms, and small linear systems in the gradient, lose three digits of 1e-16.
_ROUNDING = 1e-12

# Of sums that cancel pair by pair, relative to their terms, only 1e-16 remains, a hundredfold.
_CANCELLATION = 1e-14

KIT = Kit()


@attrs.frozen(eq=False)
class _Sample:
    """A free body of scattered particles, and random numbers."""

    simulation: Simulation
    rng: np.random.Generator

    @property
    def body(self) -> Body:
        return self.simulation.model.bodies[0]

    @property
    def positions(self) -> Array:
        return self.simulation.particles.positions

    @property
    def dimension(self) -> int:
        return self.simulation.particles.dimension

    @property
    def internal(self) -> InternalForces:
        return self.simulation.dynamics.internal

    def smooth(self) -> Array:
        """A smooth displacement (n, d) [m]."""
        # Strains of up to about 0.2: large, and far from turning inside out.
        return smooth(self.rng, self.positions, max(_CELLS[self.dimension]) * SPACING, 0.05)

    def error(self, displacements: Array, F: Array) -> float:
        """Largest difference from F, or force in units of the stiffness on a particle's face."""
        fields = self.internal.fields(displacements)
        forces = self.internal.forces(0.0, displacements)
        scale = stiffness(self.body.material) * SPACING ** (self.dimension - 1)
        return max(
            float(np.abs(fields.deformation_gradients - F).max()),
            float(np.abs(forces).max()) / scale,
        )

    def strain_energy(self, displacements: Array) -> Array:
        densities = self.internal.fields(displacements).energy_densities
        return np.asarray(densities @ self.body.particles.volumes)


def _samples(formulation: Formulation) -> Iterator[_Sample]:
    for d, rng in seeded():
        scattered = {"type": "jittered-lattice", "amplitude": 0.2, "seed": d}
        builder = scene(_COVER).body(
            "body", shape=box(_CELLS[d]), spacing=SPACING, discretisation=scattered
        )
        yield _Sample(builder.formulation(formulation).duration(1.0).build(), rng)


@KIT.errors(_ROUNDING)
def rest(formulation: Formulation) -> Iterator[float]:
    """An undeformed body has F = I and no force."""
    for sample in _samples(formulation):
        yield sample.error(np.zeros_like(sample.positions), np.eye(sample.dimension))


@KIT.errors(_ROUNDING)
def translation(formulation: Formulation) -> Iterator[float]:
    """A translated body has F = I and no force, if the gradient of a constant is zero."""
    _needs_exact(formulation, 0)
    for sample in _samples(formulation):
        yield sample.error(np.ones_like(sample.positions) * 0.3, np.eye(sample.dimension))


@KIT.errors(_ROUNDING)
def rigid_motion(formulation: Formulation) -> Iterator[float]:
    """A body rotated and translated has F = R, no stress and no force, if linear gradients are
    exact."""
    _needs_exact(formulation, 1)
    for sample in _samples(formulation):
        d = sample.dimension
        R = rotation(d, [1.0, 0.7, -0.4][: ANGLES[d]])
        u = sample.positions @ (R - np.eye(d)).T + 0.3
        yield sample.error(u, R)
        stresses = sample.internal.fields(u).stresses
        yield float(np.abs(stresses).max()) / stiffness(sample.body.material)


@KIT.errors(_ROUNDING)
def linear_patch(formulation: Formulation) -> Iterator[float]:
    """A uniform F is found at every particle, free surfaces included, if linear gradients are
    exact."""
    _needs_exact(formulation, 1)
    for sample in _samples(formulation):
        d = sample.dimension
        F = random_deformation_gradients(sample.rng, d, 1)[:, :, 0]
        fields = sample.internal.fields(sample.positions @ (F - np.eye(d)).T)
        yield float(np.abs(fields.deformation_gradients - F).max())


@KIT.errors(_CANCELLATION)
def linear_momentum(formulation: Formulation) -> Iterator[float]:
    """The forces of a free body add up to zero, if the divergence conserves momentum."""
    _needs_conservation(formulation)
    _needs_exact(formulation, 0)
    for sample in _samples(formulation):
        f = sample.internal.forces(0.0, sample.smooth())
        yield float(np.abs(f.sum(axis=0)).max() / np.abs(f).sum())


@KIT.errors(_CANCELLATION)
def angular_momentum(formulation: Formulation) -> Iterator[float]:
    """The moments of these forces add up to zero, if linear gradients are exact as well."""
    # The moments are the skew part of the sum of V_q T_q (sum over p of x_p g_qp)^T. Linear
    # exactness makes the inner sum F_q in the reference configuration, where T = P, and I in the
    # current one, where T is the Cauchy stress: both products are symmetric.
    _needs_conservation(formulation)
    _needs_exact(formulation, 1)
    for sample in _samples(formulation):
        u = sample.smooth()
        x, f = sample.positions + u, sample.internal.forces(0.0, u)
        moments = x.T @ f
        scale = (np.abs(x).T @ np.abs(f)).max()
        yield float(np.abs(moments - moments.T).max() / scale)


# A product or two, whatever their order.
@KIT.errors(1e-15)
def adjoint(formulation: Formulation) -> Iterator[float]:
    """The divergence's weights are -V_q g_qp, if it declares itself the adjoint."""
    _needs_adjoint(formulation)
    for sample in _samples(formulation):
        pairs, volumes = sample.body.pairs(), sample.body.particles.volumes
        slopes = sample.body.smoothing.gradient(pairs.offsets, pairs.distances)
        g = formulation.gradient.weights(pairs, slopes, volumes)
        expected = -volumes[pairs.columns, None] * g[pairs.reversed_order()]
        weights = formulation.divergence.weights(pairs, g, volumes)
        yield float(np.abs(weights - expected).max() / np.abs(expected).max())


# The energy's rounding, 1e-16, over the step, 3e-4 spacings, thirtyfold.
@KIT.errors(1e-11)
def energy_gradient(formulation: Formulation) -> Iterator[float]:
    """Forces are minus the derivative of the strain energy, in the reference configuration with an
    adjoint divergence."""
    if formulation.configuration is not Configuration.REFERENCE:
        raise NotPromised("the volumes and weights move with the particles")
    _needs_adjoint(formulation)
    for sample in _samples(formulation):
        u = sample.smooth()
        du = sample.rng.normal(size=u.shape) * SPACING
        f = sample.internal.forces(0.0, u)
        # Short, as the weights of a gradient that integrates by parts may be large.
        change = central_difference(partial(_Sample.strain_energy, sample), u, du, 3e-4)
        yield abs(float(change) + float(np.vdot(f, du))) / float(np.abs(f * du).sum())


def _needs_exact(formulation: Formulation, degree: int) -> None:
    gradient = formulation.gradient
    if gradient.exact_degree < degree:
        name = type(gradient).__name__
        raise NotPromised(f"{name} declares exact_degree {gradient.exact_degree}")


def _needs_conservation(formulation: Formulation) -> None:
    if not formulation.divergence.conserves_momentum:
        raise NotPromised(f"{type(formulation.divergence).__name__} does not conserve momentum")


def _needs_adjoint(formulation: Formulation) -> None:
    if not formulation.divergence.adjoint:
        raise NotPromised(f"{type(formulation.divergence).__name__} is not the adjoint")
