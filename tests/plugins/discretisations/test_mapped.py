"""Particles moved by a formula to where a curved body has its own."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from solidsph import Scene, SceneError, Simulation
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.discretisations.mapped import Mapped
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from tests.helpers.scenes import box

ON_BOUNDARY = Lattice(on_boundary=True)
# A box with a round bite out of its left side, and the map of a box onto it.
BITTEN = Difference(
    of=Box(lengths=(1.0, 0.4), origin=(0.0, -0.2)), minus=Disc(radius=0.5, centre=(-0.4, 0.0))
)
CORNER = -0.4 + sqrt(0.25 - 0.04)
BITE = {"x": f"X + (-0.4 + sqrt(0.25 - Y*Y) - {CORNER})*(1 - X)/(1 - {CORNER})"}
BEFORE = Box(lengths=(1.0 - CORNER, 0.4), origin=(CORNER, -0.2))


def test_rows_follow_the_boundary_and_the_faces_are_the_bodys() -> None:
    particles = Mapped(of=ON_BOUNDARY, before=BEFORE, to=BITE).particles(BITTEN, 0.05)
    rim = particles.positions[particles.tags["rim"]]
    assert len(rim) == 9
    assert np.hypot(rim[:, 0] + 0.4, rim[:, 1]) == pytest.approx(0.5, abs=1e-12)
    assert particles.tags["right"].sum() == 9
    assert not particles.ghosts.any()
    # Segment of a disc cut off by the chord between the corners.
    half = np.arcsin(0.4)
    area = 0.4 * (1.0 - CORNER) - 0.25 * (half - 0.5 * np.sin(2.0 * half))
    # The boundary closes but for half a sample where arc and edge cross: at each of the two
    # corners (0.05/8)^2/2 of an area of 0.37, 1e-4 in all.
    assert particles.volumes.sum() == pytest.approx(area, rel=1e-4)
    own = particles.volumes @ particles.positions[:, 1]
    assert own == pytest.approx(0.0, abs=1e-12)


def test_volumes_grow_with_the_jacobian() -> None:
    """A quarter ring: the box (r, angle) in polar coordinates has the Jacobian r."""
    ring = Difference(
        of=Annulus(inner_radius=1.0, outer_radius=2.0),
        minus=Box(lengths=(5.0, 5.0), origin=(-2.5, -5.0)),
    )
    to = {"x": "X*cos(Y)", "y": "X*sin(Y)"}
    before = Box(lengths=(1.0, pi), origin=(1.0, 0.0))
    particles = Mapped(of=Lattice(), before=before, to=to).particles(ring, 0.1)
    radii = np.linalg.norm(particles.positions, axis=1)
    expected = radii / radii.sum() * 1.5 * pi
    # The area comes from samples of the arcs, as above; ratios from differences, to 1e-8.
    assert particles.volumes == pytest.approx(expected, rel=1e-4)
    ratios = particles.volumes / radii
    assert np.ptp(ratios) < 1e-7 * ratios.mean()


def test_as_a_word_of_a_scene() -> None:
    scene = box(
        2,
        discretisation={
            "type": "mapped",
            "of": {"type": "lattice", "on_boundary": True},
            "before": {"type": "box", "lengths": [1.0, 1.0]},
            "to": {"y": "Y + 0.05*sin(2*pi*Y)"},
        },
    ).scene()
    particles = Simulation.builder(Scene.from_toml(scene.to_toml())).build().particles
    assert particles.positions[:, 1].max() == 1.0
    assert particles.volumes.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"to": {"x": "-X + 1"}}, "turns volumes over: its Jacobian is -1"),
        ({"to": {"x": "1.2*X"}}, "outside the shape"),
        ({"to": {"z": "X"}}, "component 'z' in a 2D scene"),
        ({"to": {"x": "X", "y": "Q"}}, "unknown name 'Q'"),
        ({"before": Box(lengths=(1.0,) * 3)}, "2 dimensions, but `before` has 3"),
        ({"of": Lattice(ghosts=2)}, "`of` makes 96 ghosts; set its ghosts to 0"),
    ],
)
def test_what_it_refuses(arguments: dict, expected: str) -> None:
    unit = Box(lengths=(1.0, 1.0))
    good = {"of": ON_BOUNDARY, "before": unit, "to": {"x": "X"}}
    with pytest.raises(SceneError, match=r"mapped|unknown name") as caught:
        Mapped(**{**good, **arguments}).particles(unit, 0.1)
    assert expected in str(caught.value)
