"""Faces whose names mean something else in a condition, of a third party's shape."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import pytest

from solidsph import Simulation
from solidsph.errors import BuildError
from solidsph.parts import Array, Shape, Surface
from solidsph_builtin.shapes.box import Box
from tests.helpers.scenes import SOFT

SQUARE = Box((1.0, 1.0))


@final
@attrs.frozen
class Renamed(Shape):
    """A square, the left face of which has another name."""

    left: str

    dimension: ClassVar[int] = 2

    def bounds(self) -> tuple[Array, Array]:
        return SQUARE.bounds()

    def signed_distance(self, points: Array) -> Array:
        return SQUARE.signed_distance(points)

    def surface(self, spacing: float) -> Surface:
        found = SQUARE.surface(spacing)
        names = tuple(self.left if name == "left" else name for name in found.faces)
        return attrs.evolve(found, faces=names)

    def volume(self) -> float:
        return 1.0


def built(name: str) -> Simulation:
    scene = Simulation.builder().body("block", shape=Renamed(name), spacing=0.25)
    return scene.material("neo-hookean", **SOFT).duration(1e-3).build()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        *((name, "is a variable or constant of formulas") for name in ("X", "Y", "Z", "t", "pi")),
        ("all", "names a set of particles already"),
        ("not", "is a keyword of Python"),
    ],
)
def test_a_name_that_means_something_else_is_refused(name: str, why: str) -> None:
    with pytest.raises(BuildError, match=f"the face or tag '{name}' {why}.*; choose another"):
        built(name)


def test_another_name_is_taken() -> None:
    assert "inlet" in built("inlet").particles.faces
