"""What every formulation must keep, with its gradient and divergence, in 1, 2 and 3D.

What a formulation promises follows from what its parts declare: a gradient exact for linear
fields sees rigid motions, a divergence that conserves momentum balances the forces of a free body.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import attrs
import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.maths.arrays import Array
from solidsph.promises.check import Check, Verdict, at_most, check, not_promised
from solidsph.promises.samples import (
    ANGLES,
    central_difference,
    random_deformation_gradients,
    rotation,
    seeded,
)
from solidsph.simulation import Simulation

_CELLS = {1: (12,), 2: (7, 6), 3: (5, 4, 4)}
_SPACING = 0.1  # [m]
_COVER = 3.5  # a particle in a corner has neighbours enough for second derivatives
_MATERIAL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}

# Sums of some hundred terms, and small linear systems in the gradient, lose three digits of 1e-16.
_ROUNDING = 1e-12

# Of sums that cancel pair by pair, relative to their terms, only 1e-16 remains, a hundredfold.
_CANCELLATION = 1e-14


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

    @property
    def stiffness(self) -> float:
        """lambda + 2 mu, the scale of stresses [Pa]."""
        lam, mu = self.body.material.lame_parameters
        return lam + 2.0 * mu

    @property
    def force(self) -> float:
        """The scale of forces: that stress on a face of a particle [N]."""
        return self.stiffness * _SPACING ** (self.dimension - 1)

    def smooth(self) -> Array:
        """A displacement (n, d) of one wave or so, with random directions and phases [m]."""
        d = self.dimension
        length = max(_CELLS[d]) * _SPACING
        waves, phases = self.rng.normal(size=(d, d)), self.rng.uniform(0.0, 2.0 * np.pi, d)
        # Strains of up to about 0.2: large, and far from turning inside out.
        return np.asarray(0.05 * length * np.sin(self.positions @ waves * 3.0 / length + phases))


def _samples(formulation: Formulation) -> Iterator[_Sample]:
    for d, rng in seeded():
        shape: dict[str, Any] = {
            "type": "box",
            "lengths": [_SPACING * count for count in _CELLS[d]],
        }
        simulation = (
            Simulation.builder()
            .body(
                "body",
                shape=shape,
                spacing=_SPACING,
                discretisation={"type": "jittered-lattice", "amplitude": 0.2, "seed": d},
            )
            .kernel("modified-mollifier", cover=_COVER)
            .material("neo-hookean", **_MATERIAL)
            .formulation(formulation)
            .duration(1.0)
            .build()
        )
        yield _Sample(simulation, rng)


@check
def rest(formulation: Formulation) -> Verdict:
    """An undeformed body has F = I and no force."""
    errors = []
    for sample in _samples(formulation):
        u = np.zeros_like(sample.positions)
        errors.append(_largest(sample, u, np.eye(sample.dimension)))
    return at_most(max(errors), _ROUNDING)


@check
def translation(formulation: Formulation) -> Verdict:
    """A body moved as a whole has F = I and no force, if the gradient of a constant is zero."""
    if formulation.gradient.exact_degree < 0:
        return _not_exact(formulation)
    errors = []
    for sample in _samples(formulation):
        u = np.ones_like(sample.positions) * 0.3
        errors.append(_largest(sample, u, np.eye(sample.dimension)))
    return at_most(max(errors), _ROUNDING)


@check
def rigid_motion(formulation: Formulation) -> Verdict:
    """A body turned and moved has F = R, no stress and no force, if linear gradients are exact."""
    if formulation.gradient.exact_degree < 1:
        return _not_exact(formulation)
    errors = []
    for sample in _samples(formulation):
        d = sample.dimension
        R = rotation(d, [1.0, 0.7, -0.4][: ANGLES[d]])
        u = sample.positions @ (R - np.eye(d)).T + 0.3
        errors.append(_largest(sample, u, R))
        fields = sample.internal.fields(u)
        errors.append(float(np.abs(fields.stresses).max()) / sample.stiffness)
    return at_most(max(errors), _ROUNDING)


@check
def linear_patch(formulation: Formulation) -> Verdict:
    """A uniform F is found at every particle, free surfaces included, if linear gradients are
    exact."""
    if formulation.gradient.exact_degree < 1:
        return _not_exact(formulation)
    errors = []
    for sample in _samples(formulation):
        d = sample.dimension
        F = random_deformation_gradients(sample.rng, d, 1)[:, :, 0]
        fields = sample.internal.fields(sample.positions @ (F - np.eye(d)).T)
        errors.append(float(np.abs(fields.deformation_gradients - F).max()))
    return at_most(max(errors), _ROUNDING)


@check
def linear_momentum(formulation: Formulation) -> Verdict:
    """The forces of a free body add up to zero, if the divergence conserves momentum."""
    if not formulation.divergence.conserves_momentum:
        return _not_conserving(formulation)
    if formulation.gradient.exact_degree < 0:
        return _not_exact(formulation)
    errors = []
    for sample in _samples(formulation):
        f = sample.internal.forces(0.0, sample.smooth())
        errors.append(float(np.abs(f.sum(axis=0)).max() / np.abs(f).sum()))
    return at_most(max(errors), _CANCELLATION)


@check
def angular_momentum(formulation: Formulation) -> Verdict:
    """The moments of these forces add up to zero, if linear gradients are exact as well."""
    # The moments are the skew part of the sum of V_q T_q (sum over p of x_p g_qp)^T. Linear
    # exactness makes the inner sum F_q in the reference configuration, where T = P, and I in the
    # current one, where T is the Cauchy stress: both products are symmetric.
    if not formulation.divergence.conserves_momentum:
        return _not_conserving(formulation)
    if formulation.gradient.exact_degree < 1:
        return _not_exact(formulation)
    errors = []
    for sample in _samples(formulation):
        u = sample.smooth()
        x, f = sample.positions + u, sample.internal.forces(0.0, u)
        moments = x.T @ f
        scale = (np.abs(x).T @ np.abs(f)).max()
        errors.append(float(np.abs(moments - moments.T).max() / scale))
    return at_most(max(errors), _CANCELLATION)


@check
def adjoint(formulation: Formulation) -> Verdict:
    """The divergence's weights are -V_q g_qp, if it declares itself the adjoint."""
    if not formulation.divergence.adjoint:
        return _not_adjoint(formulation)
    errors = []
    for sample in _samples(formulation):
        pairs, volumes = sample.body.pairs(), sample.body.particles.volumes
        slopes = sample.body.smoothing.gradient(pairs.offsets, pairs.distances)
        g = formulation.gradient.weights(pairs, slopes, volumes)
        expected = -volumes[pairs.columns, None] * g[pairs.reversed_order()]
        found = formulation.divergence.weights(pairs, g, volumes)
        errors.append(float(np.abs(found - expected).max() / np.abs(expected).max()))
    # A product or two, whatever their order.
    return at_most(max(errors), 1e-15)


@check
def energy_gradient(formulation: Formulation) -> Verdict:
    """Forces are minus the derivative of the strain energy, in the reference configuration with an
    adjoint divergence."""
    if formulation.configuration is not Configuration.REFERENCE:
        return not_promised("the volumes and weights move with the particles")
    if not formulation.divergence.adjoint:
        return _not_adjoint(formulation)
    errors = []
    for sample in _samples(formulation):
        u = sample.smooth()
        du = sample.rng.normal(size=u.shape) * _SPACING
        power = -float(np.vdot(sample.internal.forces(0.0, u), du))
        found = central_difference(partial(_strain_energy, sample), u, du, 1e-3)
        scale = float(np.abs(sample.internal.forces(0.0, u) * du).sum())
        errors.append(abs(float(found) - power) / scale)
    # The energy's rounding, 1e-16, over the step, 1e-3 spacings, a hundredfold.
    return at_most(max(errors), 1e-11)


CHECKS: tuple[Check, ...] = (
    rest,
    translation,
    rigid_motion,
    linear_patch,
    linear_momentum,
    angular_momentum,
    adjoint,
    energy_gradient,
)


def _largest(sample: _Sample, displacements: Array, F: Array) -> float:
    """How far from F and from no force, each on its own scale."""
    fields: StressFields = sample.internal.fields(displacements)
    forces = sample.internal.forces(0.0, displacements)
    return max(
        float(np.abs(fields.deformation_gradients - F).max()),
        float(np.abs(forces).max()) / sample.force,
    )


def _strain_energy(sample: _Sample, displacements: Array) -> Array:
    densities = sample.internal.fields(displacements).energy_densities
    return np.asarray(densities @ sample.body.particles.volumes)


def _not_exact(formulation: Formulation) -> Verdict:
    gradient = formulation.gradient
    return not_promised(f"{type(gradient).__name__} declares exact_degree {gradient.exact_degree}")


def _not_conserving(formulation: Formulation) -> Verdict:
    return not_promised(f"{type(formulation.divergence).__name__} does not conserve momentum")


def _not_adjoint(formulation: Formulation) -> Verdict:
    return not_promised(f"{type(formulation.divergence).__name__} is not the adjoint")
