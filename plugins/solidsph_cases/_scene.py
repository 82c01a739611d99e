"""The scenes of cases: a body of a material, and what several of them do to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from solidsph.errors import SceneError
from solidsph.interfaces.material import Material
from solidsph.registry.construct import describe
from solidsph.registry.parameters import check_positive
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import PartLike
from solidsph.simulation import Simulation
from solidsph.studies.scene_words import changed
from solidsph_builtin.materials.neo_hookean import NeoHookean

ON_BOUNDARY: Mapping[str, Any] = {"type": "lattice", "on_boundary": True}
DISORDER: Mapping[str, str] = {
    "discretisation": "particles in no order",
    "gradient": "the recommended one for them too: particles that a scene arranges by itself get a "
    "linear one",
}
"""Why `disordered` names these parts."""

SOFT = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)


def solid(
    title: str,
    name: str,
    shape: PartLike,
    spacing: float,
    material: Material,
    **options: Any,
) -> SceneBuilder:
    """A scene with one body.

    Args:
        name: of the body.
        spacing: of its particles [m].
        options: of the body, such as its discretisation and its tags.
    """
    builder = Simulation.builder().title(title)
    builder = builder.body(name, shape=shape, spacing=spacing, **options)
    return builder.material(describe("materials", material))


def box(*lengths: float, origin: list[float] | None = None) -> Mapping[str, Any]:
    """A box with sides of those lengths [m], with a corner at `origin` or at 0."""
    shape = {"type": "box", "lengths": list(lengths)}
    return shape if origin is None else {**shape, "origin": origin}


def between_walls(builder: SceneBuilder, dimension: int) -> SceneBuilder:
    """`builder` with frictionless walls on all sides across the x axis."""
    sides = {"y": ("bottom", "top"), "z": ("back", "front")}
    for axis in "yz"[: dimension - 1]:
        for side in sides[axis]:
            builder = builder.boundary("clamp", where=side, axes=[axis])
    return builder


def disordered(scene: Scene, amplitude: float) -> Scene:
    """`scene` with every particle inside moved at random, up to `amplitude` [spacings]; see
    `DISORDER`."""
    if amplitude == 0.0:
        return scene
    moved = {"type": "jittered", "of": "fitted", "amplitude": amplitude, "seed": 1}
    return changed(changed(scene, "discretisation", moved), "gradient", "consistent")


def check_count(case: str, name: str, value: object, least: int) -> None:
    """Raise SceneError unless `value` is a whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise SceneError(
            f"case {case!r}: {name} must be a whole number of at least {least}, got {value!r}"
        )


def check_all_positive(label: str, case: object, **units: str) -> None:
    """Raise SceneError unless every parameter named in `units` is positive and finite."""
    for name, unit in units.items():
        check_positive(label, name, getattr(case, name), unit.replace("_", " "))
