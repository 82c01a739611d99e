"""Small scenes that several tests start from."""

from __future__ import annotations

from typing import Any

from solidsph import Simulation
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import example_part

SOFT = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}


def box(d: int, cells: int = 6, **body: Any) -> SceneBuilder:
    """A box of unit length with `cells` particles along each axis, in the middles of their cells,
    without boundaries."""
    shape = {"type": "interval", "length": 1.0} if d == 1 else {"type": "box", "lengths": [1.0] * d}
    return (
        Simulation.builder()
        .scheme("corrected")
        .body("block", shape=shape, spacing=1.0 / cells, **body)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian")
        .duration(1e-2)
    )


def touching(d: int, cells: int = 6, aside: float = 0.0, **body: Any) -> SceneBuilder:
    """Two such boxes, the second beside the first with no gap, and moved aside."""
    origin = [1.0, *[aside] * (d - 1)]
    shape = (
        {"type": "interval", "length": 1.0, "origin": 1.0}
        if d == 1
        else {"type": "box", "lengths": [1.0] * d, "origin": origin}
    )
    return box(d, cells, **body).body("other", shape=shape, spacing=1.0 / cells, **body)


def with_effect(name: str, d: int, cells: int = 6) -> SceneBuilder:
    """A scene with an effect of typical parameters, of as many bodies as it needs."""
    scene = touching(d, cells) if name in ("contact", "joint") else box(d, cells)
    return scene.effect(example_part("effects", name))


SCENE_TOML = """
title = "a block pulled to the right"
duration = 0.01
outputs = 5

[body.block]
shape = {type = "box", lengths = [1.0, 0.5]}
spacing = 0.125

[kernel]
type = "modified-mollifier"
cover = 3.0

[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0

[formulation]
type = "total-lagrangian"
gradient = "corrected"

[[boundary]]
type = "clamp"
where = "left"

[[boundary]]
type = "traction"
where = "right"
traction = {x = "1e3*min(t/0.005, 1)"}

[integrator]
type = "central-difference"
"""

# Gradients that know the surface of a body in its reference configuration, and are refused in
# another.
REFERENCE_ONLY = ("consistent",)
