"""Bodies of soft rubber on which formulations, boundary handlers and effects are checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from solidsph.assembly.builder import Builder
from solidsph.maths.arrays import Array
from solidsph.simulation import Simulation

SPACING = 0.1  # [m]
_MATERIAL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}


def scene(cover: float) -> Builder[Simulation]:
    """A scene without a body, with a kernel of this cover [spacings]."""
    return (
        Simulation.builder()
        .kernel("modified-mollifier", cover=cover)
        .material("neo-hookean", **_MATERIAL)
    )


def box(cells: Sequence[int], origin: Sequence[float] | None = None) -> dict[str, Any]:
    """A box of so many spacings along each axis, from its lower corner `origin` [m]."""
    return {
        "type": "box",
        "lengths": [SPACING * count for count in cells],
        "origin": [0.0] * len(cells) if origin is None else list(origin),
    }


def with_waves(
    builder: Builder[Simulation], dimension: int, speed: float, duration: float
) -> Builder[Simulation]:
    """The scene with waves of this speed [m/s], for a duration [s], in steps of a fortieth of the
    CFL step."""
    waves = {axis: f"{speed}*sin({3 + k}*X+{k})" for k, axis in enumerate("xyz"[:dimension])}
    return (
        builder.initial(velocity=waves)
        .integrator("central-difference", time_step_factor=0.025)
        .engine("matrix")
        .duration(duration)
        .outputs(2)
    )


def smooth(rng: np.random.Generator, positions: Array, length: float, size: float) -> Array:
    """A displacement (n, d) of about one wave over a body's `length` [m], with random directions
    and phases; its amplitude is the part `size` of the length."""
    d = positions.shape[1]
    waves, phases = rng.normal(size=(d, d)), rng.uniform(0.0, 2.0 * np.pi, d)
    return np.asarray(size * length * np.sin(positions @ waves * 3.0 / length + phases))
