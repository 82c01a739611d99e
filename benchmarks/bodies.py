"""The bodies that are timed: blocks, sheets and bars of one material, bent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct

SPACING, COVER = 0.01, 2.6
MATERIAL = {
    "type": "neo-hookean",
    "density": 1000.0,
    "youngs_modulus": 2e6,
    "poissons_ratio": 0.3975,
}
ARRANGEMENTS: Mapping[str, Any] = {
    "lattice": {"type": "lattice"},
    "disordered": {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1},
}

# Particles along each axis. Lines are 100 long where they can be, so that the share of particles
# near their ends does not change with the size.
CELLS: Mapping[int, Mapping[int, tuple[int, ...]]] = {
    1: {n: (n,) for n in (1_000, 10_000, 100_000, 1_000_000)},
    2: {n: (n // 100, 100) for n in (1_000, 10_000, 100_000, 1_000_000)},
    3: {
        1_000: (10, 10, 10),
        10_000: (10, 10, 100),
        100_000: (32, 32, 100),
        1_000_000: (100, 100, 100),
    },
}
SIZES = tuple(CELLS[3])


def shape(cells: tuple[int, ...]) -> dict[str, Any]:
    """A box of so many particles along each axis, as a scene names it."""
    lengths = [SPACING * n for n in cells]
    if len(cells) == 1:
        return {"type": "interval", "length": lengths[0]}
    return {"type": "box", "lengths": lengths}


def body(cells: tuple[int, ...], arrangement: str) -> Body:
    """A total Lagrangian body with linearly corrected gradients, the default of a scene."""
    discretisation = construct("discretisations", ARRANGEMENTS[arrangement])
    particles = discretisation.particles(construct("shapes", shape(cells)), SPACING)
    kernel = construct("kernels", "cubic-spline")
    return Body(
        name="block",
        extent=slice(0, particles.count),
        particles=particles,
        smoothing=smoothing_kernel(kernel, len(cells), COVER * SPACING),
        material=construct("materials", MATERIAL),
        formulation=construct("formulations", "total-lagrangian"),
    )


def displacements(body: Body) -> Array:
    """What v_y = 0.01 c0 sin(pi x / (2 Lx)) has done after the time of a wave across the block.

    In one dimension the motion is along the bar.
    """
    X = body.particles.positions
    length = X[:, 0].max() + 0.5 * SPACING
    u = np.zeros_like(X)
    u[:, min(1, X.shape[1] - 1)] = 0.01 * length * np.sin(0.5 * np.pi * X[:, 0] / length)
    return u
