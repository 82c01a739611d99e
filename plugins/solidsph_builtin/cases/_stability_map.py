"""Growth of small deviations over stretch and cover, in one Lagrangian form."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import ceil, nan

import attrs
import numpy as np
from scipy.optimize import brentq

from solidsph.arrays import Array, Mask
from solidsph.builder import Builder
from solidsph.particles import State
from solidsph.simulation import Simulation
from solidsph.studies.dispersion import dispersion
from solidsph_builtin.materials.neo_hookean import NeoHookean

TOTAL, UPDATED = FORMS = ("total-lagrangian", "updated-lagrangian")

# Growth counts from here on [e-foldings per wave transit of one spacing]: rounding leaves 1e-4 of
# a neutral mode, the square root of what it leaves of its eigenvalue.
GROWS = 5e-4


@attrs.frozen(eq=False)
class StabilityMap:
    """Growth rate of the fastest mode of an endless bar at uniform stretch."""

    stretches: Array  # (s,) [-]
    covers: Array  # (c,) [spacings in the reference configuration]
    rates: Array  # (c, s) [e-foldings per wave transit of one spacing]
    seen: Array  # (c, s) stretch that the sums make of the uniform one: a small cover misses it [-]
    connected: Mask  # (c, s) whether a particle has a neighbour where the sums are taken

    @property
    def grows(self) -> Mask:
        """Where it is unstable, (c, s)."""
        grows: Mask = self.rates > GROWS
        return grows


@cache
def stability_map(
    form: str, poissons_ratio: float, stretches: tuple[float, ...], covers: tuple[float, ...]
) -> StabilityMap:
    """The map of one form; with lengths in spacings and times in transits of one, only Poisson's
    ratio of the material is left."""
    rates, seen = (np.empty((len(covers), len(stretches))) for _ in range(2))
    for row, cover in enumerate(covers):
        simulation = _bar(form, poissons_ratio, cover, min(1.0, *stretches))
        for column, stretch in enumerate(stretches):
            uniform = _stretched(simulation, stretch)
            rates[row, column] = dispersion(simulation.dynamics, uniform).growth_rate
            F = simulation.dynamics.observe(uniform).deformation_gradients
            seen[row, column] = F[len(F) // 2, 0, 0]
    # In the current configuration neighbours move out of the support that was cut at the start.
    spread = np.array(stretches) if form == UPDATED else np.ones(len(stretches))
    connected = spread[None, :] < np.array(covers)[:, None]
    return StabilityMap(np.array(stretches), np.array(covers), rates, seen, connected)


def onset(form: str, poissons_ratio: float, cover: float, rate: float) -> float:
    """Smallest stretch in tension at which deviations grow at `rate`, in the unit of the map; nan
    if there is none up to 2."""
    simulation = _bar(form, poissons_ratio, cover, 1.0)

    def excess(stretch: float) -> float:
        uniform = _stretched(simulation, stretch)
        return dispersion(simulation.dynamics, uniform).growth_rate - rate

    for low, high in pairwise([1.0, *(1.0 + np.geomspace(1e-3, 1.0, 25))]):
        if excess(high) > 0.0:
            return float(brentq(excess, low, high, xtol=1e-9))
    return nan


def _stretched(simulation: Simulation, stretch: float) -> State:
    positions = stretch * simulation.particles.positions
    return attrs.evolve(simulation.start(), positions=positions)


def _bar(form: str, poissons_ratio: float, cover: float, least_stretch: float) -> Simulation:
    """A bar whose ends its middle does not feel: with spacing and wave speed 1, and no boundary."""
    # Force from stress, stress from the gradient, gradient from the crowding of neighbours: a
    # particle answers to others within three supports, and those again.
    spacings = 4 * (ceil(3.0 * cover / least_stretch) + 1)
    unit = NeoHookean(youngs_modulus=1.0, poissons_ratio=poissons_ratio, density=1.0)
    return (
        Builder()
        .body(
            "bar",
            shape={"type": "interval", "length": float(spacings)},
            spacing=1.0,
            discretisation={"type": "lattice", "on_boundary": True},
        )
        .kernel("modified-mollifier", cover=cover)
        .material(attrs.evolve(unit, youngs_modulus=1.0 / unit.wave_speed**2))
        .formulation(form, gradient="difference", divergence="plain")
        .engine("matrix")
        .duration(1.0)
        .build()
    )
