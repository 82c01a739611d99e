"""Growth and critical step of small deviations of an endless bar, over stretch and cover."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import attrs
import numpy as np

from solidsph.errors import BuildError
from solidsph.interfaces.formulation import Configuration
from solidsph.maths.arrays import Array, Mask
from solidsph.run.cfl_step import cfl_step
from solidsph.studies.certificate import GROWS
from solidsph.studies.dispersion import check_uniform, dispersion, lattice_response
from solidsph.studies.scheme import Scheme, stretched


@attrs.frozen(eq=False)
class StabilityMap:
    """Fastest modes of an endless bar at uniform stretch."""

    stretches: Array  # (s,) [-]
    covers: Array  # (c,) [spacings in the reference configuration]
    rates: Array  # (c, s) largest growth rates [e-foldings per wave transit of one spacing]
    factors: Array  # (c, s) largest stable time step over the CFL step [-]
    seen: Array  # (c, s) stretch that the discrete gradient gives, inexact for small covers [-]
    connected: Mask  # (c, s) whether particles have neighbours in the configuration of the sums

    @property
    def grows(self) -> Mask:
        """Where the bar is unstable, (c, s)."""
        grows: Mask = self.rates > GROWS
        return grows


def stability_map(
    scheme: Scheme, stretches: Sequence[float], covers: Sequence[float]
) -> StabilityMap:
    """Stability map of a scheme; its own cover is ignored."""
    shape = (len(covers), len(stretches))
    rates, factors, seen = (np.full(shape, nan) for _ in range(3))
    for row, cover in enumerate(covers):
        wider = attrs.evolve(scheme, cover=cover)
        simulation = wider.deep_inside.simulation(1, [wider.depth(min(1.0, *stretches))])
        start = stretched(simulation, [1.0])
        check_uniform(simulation.dynamics, start, lattice_response(simulation.dynamics, start))
        loads, bodies = simulation.dynamics.loads, simulation.model.bodies
        limit = scheme.integrator.stability_limit / cfl_step(simulation.integrator, loads, bodies)
        for column, stretch in enumerate(stretches):
            uniform = stretched(simulation, [stretch])
            try:
                waves = dispersion(simulation.dynamics, uniform)
                F = simulation.dynamics.observe(uniform).deformation_gradients
            except BuildError:  # the gradient needs neighbours
                continue
            rates[row, column] = waves.growth_rate * scheme.transit
            factors[row, column] = limit / max(waves.highest_frequency, 1e-300)
            seen[row, column] = F[len(F) // 2, 0, 0]
    # In the current configuration, stretch moves neighbours out of the support.
    current = scheme.formulation.configuration is Configuration.CURRENT
    spread = np.array(stretches) if current else np.ones(len(stretches))
    return StabilityMap(
        stretches=np.array(stretches),
        covers=np.array(covers),
        rates=rates,
        factors=factors,
        seen=seen,
        connected=spread[None, :] < np.array(covers)[:, None],
    )
