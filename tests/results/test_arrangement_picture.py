"""Pictures of scenes before they run, and what parts show in them."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from PIL import Image

from solidsph import Simulation
from solidsph.assembly.arrangement import arrangement_of
from solidsph.errors import BuildError
from solidsph.interfaces.body import Body
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.marks import Arrows, Held, Links, Plane
from solidsph.registry import registry
from solidsph.results.projection import PAGE, SLANTED, UPRIGHT, View
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import example_part
from tests.helpers.scenes import box, touching, with_effect


def beam(d: int) -> SceneBuilder:
    """A body that is held and loaded in every way that a picture shows."""
    scene = box(d, tags={"end": "X > 0.8"}).boundary("clamp", where="left")
    if d > 1:
        scene.boundary("pressure", where="top", pressure="1e3*sin(300*t)")
        scene.effect("artificial-viscosity").effect("body-force", acceleration={"y": -9.81})
    scene.boundary("traction", where="right", traction={"x": 2e5})
    return scene.probe(label="middle", quantity="velocity x", point=[0.5] * d)


def names_in(figure: Figure) -> list[str]:
    return [text.get_text() for axis in figure.axes for text in axis.texts]


def legend_of(figure: Figure) -> str:
    return " ".join(text.get_text().replace("\n", " ") for text in figure.legends[0].get_texts())


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_scene_is_drawn_without_neighbours_and_gradients(
    d: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*arguments: object, **named: object) -> None:
        raise AssertionError("a picture needs no neighbours")

    monkeypatch.setattr(Body, "pairs", refused)
    monkeypatch.setattr(Gradient, "of_body", refused)
    figure = beam(d).plot()
    assert [axis.get_aspect() for axis in figure.axes] == [1.0] * (1 if d < 3 else 4)
    text = legend_of(figure)
    assert f"block: {6**d} particles, 0.1667 m apart" in text
    assert f"clamp left: {6 ** (d - 1)} held in {', '.join('xyz'[:d])}" in text
    assert "traction right: traction, largest 2e+05 Pa" in text
    assert "middle: velocity x" in text
    assert {"left", "middle"} <= set(names_in(figure))
    assert any("end" in name for name in names_in(figure))  # the tag of the scene


@pytest.mark.parametrize("d", [2, 3])
def test_a_built_scene_is_drawn_alike(d: int) -> None:
    pictures = [
        np.asarray(Image.open(BytesIO(figure._repr_png_())))
        for figure in (beam(d).plot(), beam(d).build().plot())
    ]
    assert np.array_equal(*pictures)
    assert len(np.unique(pictures[0].reshape(-1, pictures[0].shape[2]), axis=0)) > 10


def test_particles_are_drawn_at_their_size() -> None:
    (axis,) = box(2).plot().axes
    (discs,) = (c for c in axis.collections if isinstance(c, EllipseCollection))
    assert np.allclose(discs._widths, 0.5 / 6)  # Matplotlib keeps halves
    x = (np.arange(6) + 0.5) / 6
    assert np.allclose(np.unique(np.round(discs.get_offsets(), 12)), x)


def test_a_dash_shows_the_direction_that_is_held() -> None:
    (axis,) = box(2).boundary("clamp", where="left", axes=["y"]).plot().axes
    ends = np.concatenate(
        [c.get_segments() for c in axis.collections if isinstance(c, LineCollection)]
    )
    along = ends[:, 1] - ends[:, 0]
    assert len(along) == 6
    assert np.all(along[:, 0] == 0.0)
    assert np.all(along[:, 1] > 0.0)


def test_arrows_show_a_load_at_its_largest() -> None:
    scene = box(2).boundary("pressure", where="top", pressure="1e3*sin(pi*t/1e-2)")
    (mark,) = arrangement_of(scene.scene()).marks["pressure top"]
    assert isinstance(mark, Arrows)
    assert mark.time == 0.5e-2
    assert np.allclose(mark.vectors, [0.0, -1e3])
    (axis,) = scene.plot().axes
    (arrows,) = (c for c in axis.collections if isinstance(c, Quiver) and c.N)
    tips = arrows.get_offsets()[:, 1] + arrows.V
    assert np.all(arrows.V < 0.0)
    assert np.allclose(tips, 1.0 - 0.5 / 6)  # a push ends at the particles of the face


def test_initial_velocities_joints_and_walls_are_drawn() -> None:
    scene = touching(3, 4).effect("joint", label="glue")
    scene.effect("rigid-wall", label="floor", point={"y": -0.5}, normal={"y": 2.0})
    scene.initial(where="block", velocity={"x": 3.0})
    marks = arrangement_of(scene.scene()).marks
    (links,), (wall,), (start,) = marks["glue"], marks["floor"], marks["initial"]
    assert isinstance(links, Links)
    assert np.all(links.ends[:, 0, 0] < 1.0)
    assert np.all(links.ends[:, 1, 0] > 1.0)
    assert isinstance(wall, Plane)
    assert np.array_equal(wall.normal, [0.0, 1.0, 0.0])
    assert isinstance(start, Arrows)
    assert np.array_equal(start.vectors, np.tile([3.0, 0.0, 0.0], (64, 1)))
    figure = scene.plot()
    assert "floor: plane" in legend_of(figure)
    low, high = figure.axes[1].get_ylim()
    assert low < -0.5  # there is room for the wall
    assert high > 1.0


def test_a_mirror_plane_with_ghosts_only_is_a_plane() -> None:
    ghosts = {"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]}
    scene = box(2, discretisation=ghosts).boundary("symmetry", axis="x")
    (plane,) = arrangement_of(scene.scene()).marks["symmetry"]
    assert isinstance(plane, Plane)
    assert np.array_equal(plane.normal, [1.0, 0.0])


@pytest.mark.parametrize("name", registry.names("effects"))
def test_every_effect_can_be_drawn(name: str) -> None:
    with_effect(name, 2).plot()


@pytest.mark.parametrize("name", ["prescribed-motion", "approximate-neumann", "ghost-extension"])
def test_other_boundaries_can_be_drawn(name: str) -> None:
    ghosts = {"type": "lattice", "ghosts": 3}
    scene = box(1, discretisation=ghosts)
    if name != "ghost-extension":
        scene.boundary("ghost-extension")
    marks = arrangement_of(scene.boundary(example_part("boundaries", name), label="it").scene())
    kinds = {type(mark) for mark in marks.marks["it"]}
    expected = {"prescribed-motion": {Held, Arrows}, "approximate-neumann": {Arrows}}
    assert kinds == expected.get(name, set())
    scene.plot()


@pytest.mark.parametrize("view", [PAGE, SLANTED, *UPRIGHT], ids=lambda view: view.name)
def test_views_keep_lengths_in_the_page(view: View) -> None:
    directions = np.stack([view.right, view.up, view.toward])
    assert np.allclose(directions @ directions.T, np.eye(3), atol=1e-15)
    assert view.flat(np.array([[3.0, 4.0]])).shape == (1, 2)


def test_a_scene_that_cannot_be_built_is_told() -> None:
    scene = Simulation.builder(box(2).boundary("clamp", where="lft").scene())
    with pytest.raises(BuildError, match="did you mean 'left'"):
        scene.plot()
    outside = box(2).probe(label="far", quantity="velocity", point=[9.0, 0.0])
    with pytest.raises(BuildError, match="far"):
        outside.plot()
