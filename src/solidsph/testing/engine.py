"""What every engine must keep: the sums of the reference, in a way of its own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import final

import attrs
import numpy as np

from solidsph.conformance.check import Broken, Kit, Verdict, at_most, worst
from solidsph.conformance.samples import accepted, kept_for_last
from solidsph.engines.matrix import MatrixEngine
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces
from solidsph.interfaces.plan import BodySize
from solidsph.interfaces.terms import Observation, StressTerm
from solidsph.maths.arrays import Array
from solidsph.simulation import Simulation

_SPACING = 0.1  # [m]
_MATERIAL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}

# Sums of some hundred terms of opposite signs, in units of the precision of the engine's numbers.
_ROUNDING = 5e3

_FORMS = (
    (1, {"type": "total-lagrangian"}),
    (2, {"type": "total-lagrangian", "gradient": "standard", "divergence": "plain"}),
    (2, {"type": "updated-lagrangian"}),
    (3, {"type": "total-lagrangian"}),
)

KIT = Kit()


@attrs.frozen(eq=False)
class _Sample:
    """Two bodies by an engine and by the reference, and displacements (n, d) [m]."""

    engine: Engine
    simulation: Simulation
    own: InternalForces
    reference: InternalForces
    displacements: Array

    @property
    def bodies(self) -> list[Body]:
        return list(self.simulation.model.bodies)

    def agree(self, own: Array, reference: Array) -> Verdict:
        """Whether both are the same but for rounding."""
        if np.shape(own) != np.shape(reference):
            raise Broken(f"shape {np.shape(own)}, {np.shape(reference)} is expected")
        error = float(np.abs(own - reference).max() / np.abs(reference).max())
        return at_most(error, _ROUNDING * self.own.precision)


@kept_for_last
def _samples(engine: Engine) -> list[_Sample]:
    """Bodies in every dimension and form that the engine does not refuse.

    Raises:
        SceneError: it refuses all of them.
    """
    attempts = (
        (f"{d}D, {form}", partial(_prepared, engine, d, form, seed))
        for seed, (d, form) in enumerate(_FORMS)
    )
    return accepted("form", attempts, (BuildError, SceneError))


def _prepared(engine: Engine, d: int, form: Mapping[str, str], seed: int) -> _Sample:
    builder = Simulation.builder().material("neo-hookean", **_MATERIAL).duration(1e-3)
    jittered = {"type": "jittered-lattice", "amplitude": 0.1, "seed": seed}
    for name, origin in (("one", 0.0), ("other", 1.0)):
        shape = (
            {"type": "interval", "length": 0.8, "origin": origin}
            if d == 1
            else {"type": "box", "lengths": [0.5] * d, "origin": [origin] * d}
        )
        builder.body(name, shape=shape, spacing=_SPACING, discretisation=jittered)
    simulation = builder.kernel("cubic-spline").formulation(form).engine("matrix").build()
    u = np.random.default_rng(seed).normal(size=simulation.particles.positions.shape)
    return _Sample(
        engine=engine,
        simulation=simulation,
        own=engine.prepare(simulation.model.bodies, ()),
        reference=simulation.dynamics.internal,
        displacements=0.02 * _SPACING * u,
    )


@KIT.check
def forces(engine: Engine) -> Verdict:
    """Forces are those of sparse matrices, to the rounding of the engine's own precision."""
    return worst(
        [
            one.agree(
                one.own.forces(0.0, one.displacements), one.reference.forces(0.0, one.displacements)
            )
            for one in _samples(engine)
        ]
    )


@KIT.check
def fields(engine: Engine) -> Verdict:
    """Deformation gradients, stresses and energies are those of sparse matrices."""
    names = ("deformation_gradients", "stresses", "energy_densities")
    return worst(
        [
            one.agree(
                getattr(one.own.fields(one.displacements), name),
                getattr(one.reference.fields(one.displacements), name),
            )
            for one in _samples(engine)
            for name in names
        ]
    )


@KIT.check
def passes(engine: Engine) -> Verdict:
    """The gradient of a displacement, and the forces of a stress, are those of sparse matrices."""
    verdicts = []
    for one in _samples(engine):
        u, (n, d) = one.displacements, one.displacements.shape
        verdicts.append(one.agree(one.own.gradients(u), one.reference.gradients(u)))
        stress = np.random.default_rng(0).normal(size=(d, d, n))
        own, reference = (each.spread(u, stress.copy()) for each in (one.own, one.reference))
        verdicts.append(one.agree(own, reference))
    return worst(verdicts)


@KIT.check
def stress_terms(engine: Engine) -> Verdict:
    """A stress term changes the stress between the law and the forces."""
    verdicts = []
    for one in _samples(engine):
        own, reference = (
            each.prepare(one.bodies, [_Relieved()]).forces(0.0, one.displacements)
            for each in (engine, MatrixEngine())
        )
        verdicts.append(one.agree(own, reference))
    return worst(verdicts)


@KIT.check
def plan(engine: Engine) -> Verdict:
    """What it plans has counts from 0 on, also for bodies that are not built."""
    for one in _samples(engine):
        d = one.displacements.shape[1]
        size = BodySize(dimension=d, particles=1e3, pairs=2e4, moving=False)
        planned = one.own.plan(one.simulation.dynamics, one.simulation.integrator)
        expected = engine.expected([size], 1000)
        for operations in (*planned.engine, *expected.engine):
            counts = (operations.pairs, operations.particles, operations.touched, operations.held)
            if min(counts) < 0:
                raise Broken(f"{operations}")
        if one.own.pair_count < 1 or not any(o.pairs for o in expected.engine):
            raise Broken("no pairs")
    return Verdict(True, "as required")


@final
@attrs.frozen(eq=False)
class _Relieved(StressTerm):
    """Takes the stress of every third particle away."""

    label: str = "relieved"

    def impose_stress(self, time: float, stress: Array) -> None:
        stress[:, :, ::3] = 0.0

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
