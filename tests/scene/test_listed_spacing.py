"""A spacing that a file lists, place by place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, SceneError, Simulation
from solidsph.maths.arrays import Array
from solidsph.model.spacing import STEEPEST, SpacingField
from solidsph.registry.construct import construct
from solidsph.scene.graded_spacing import least_spacing, predicted_count, scaled, spacing_field
from solidsph.scene.listed_spacing import list_of, listed_spacing
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import BodyScene
from solidsph.studies.scene_case import SceneCase
from solidsph.studies.task import Task
from tests.helpers.scenes import SOFT

BOXES: dict[int, Any] = {
    1: {"type": "interval", "length": 1.0},
    2: {"type": "box", "lengths": [1.0, 0.5]},
    3: {"type": "box", "lengths": [1.0, 0.5, 0.5]},
}


def grid(dimension: int, step: float = 0.125) -> Array:
    """Places of a lattice over the box, its surface included."""
    axes = [np.arange(0.0, length + 1e-9, step) for length in (1.0, 0.5, 0.5)[:dimension]]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)


def body(folder: Path, text: str, shape: Any = BOXES[2], **words: Any) -> BodyScene:
    path = folder / "spacing.csv"
    path.write_text(text)
    return BodyScene(shape, {"file": str(path), **words})


def field(body: BodyScene) -> SpacingField:
    return spacing_field(body, construct("shapes", body.shape))


def inside(shape: Any) -> Array:
    low, high = construct("shapes", shape).bounds()
    X = np.random.default_rng(1).uniform(low, high, (500, len(low)))
    return np.asarray(X)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_between_listed_places_it_is_linear(dimension: int, tmp_path: Path) -> None:
    slopes = np.array([0.1, 0.05, -0.02])[:dimension]
    places = grid(dimension)
    listed = body(tmp_path, list_of(places, 0.06 + places @ slopes), BOXES[dimension])
    X = inside(listed.shape)
    np.testing.assert_allclose(field(listed).at(X), 0.06 + X @ slopes, rtol=1e-8)


@pytest.mark.parametrize("dimension", [1, 2])
def test_a_list_that_is_too_steep_is_finer_than_listed(dimension: int, tmp_path: Path) -> None:
    places = grid(dimension, 0.03125)
    s = np.where(places[:, 0] < 0.3, 0.02, 0.2)
    listed = body(tmp_path, list_of(places, s), BOXES[dimension])
    at = listed_spacing(listed.spacing, *construct("shapes", listed.shape).bounds())  # type: ignore[arg-type]
    X, step = inside(listed.shape), 1e-6
    found = at(X)
    assert np.all(found[X[:, 0] < 0.28] == pytest.approx(0.02, rel=1e-9))
    assert found.max() > 0.15  # it grows nevertheless
    axes = step * np.eye(dimension)
    slopes = np.stack([(at(X + a) - at(X - a)) / (2.0 * step) for a in axes], axis=1)
    assert np.linalg.norm(slopes, axis=1).max() <= STEEPEST * (1.0 + 1e-6)


def test_any_number_of_places_is_a_list(tmp_path: Path) -> None:
    alone = field(body(tmp_path, "0.5,0.25,0.03\n"))
    assert alone.least == alone.greatest == 0.03
    in_a_row = field(
        body(tmp_path, "X,Y,spacing\n# a row\n0,0.25,0.03\n0.5,0.25,0.03\n1,0.25,0.06")
    )
    assert in_a_row.at(np.array([[0.75, 0.25]])) == pytest.approx(0.045)
    twice = field(body(tmp_path, "0,0,0.05\n1,0.5,0.04\n0,0,0.03\n"))
    assert twice.at(np.array([[0.0, 0.0]])) == pytest.approx(0.03)


def test_beyond_the_list_it_is_that_of_the_nearest(tmp_path: Path) -> None:
    left = grid(2)[grid(2)[:, 0] < 0.3]
    s = field(body(tmp_path, list_of(left, np.full(len(left), 0.04)))).at(inside(BOXES[2]))
    np.testing.assert_allclose(s, 0.04, rtol=1e-12)


def test_a_factor_makes_all_of_it_finer(tmp_path: Path) -> None:
    places = grid(2, 0.0625)
    listed = body(tmp_path, list_of(places, np.where(places[:, 0] < 0.3, 0.02, 0.2)))
    X = inside(listed.shape)
    finer = scaled(listed, 0.5)
    assert finer.spacing == {**listed.spacing, "factor": 0.5}  # type: ignore[dict-item]
    np.testing.assert_allclose(field(finer).at(X), 0.5 * field(listed).at(X), rtol=1e-12)
    assert least_spacing(scaled(finer, 3.0)) == pytest.approx(0.03)
    entry = {"where": "right", "spacing": 0.02, "over": 0.9}
    with_entry = BodyScene(listed.shape, listed.spacing, refine=(entry,))
    assert field(with_entry).at(np.array([[1.0, 0.2]])) == pytest.approx(0.02, rel=1e-6)


def test_particles_follow_a_list(tmp_path: Path) -> None:
    places = grid(2)
    listed = body(tmp_path, list_of(places, 0.02 + 0.06 * places[:, 0]))
    builder = Simulation.builder().body("plate", shape=listed.shape, spacing=listed.spacing)
    scene = builder.material("neo-hookean", **SOFT).duration(1e-3).scene()
    particles = Simulation.builder(scene).build().particles
    expected = 0.02 + 0.06 * particles.positions[:, 0]
    np.testing.assert_allclose(particles.spacings, expected, rtol=1e-6)
    foreseen = predicted_count(field(listed), construct("shapes", listed.shape))
    assert particles.count == pytest.approx(foreseen, rel=0.05)  # as of a formula
    assert Scene.from_toml(scene.to_toml()) == scene


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it lists no place; its columns must be X, Y, spacing, in metres"),
        ("X,Y,spacing\n", "it lists no place"),
        ("0,0,0.1\n0.1,0.1,nan\n", r"place 2 is \[0.1, 0.1, nan\]; all must be finite"),
        ("0,0,-0.1\n", "and the spacing positive"),
        ("0,0,0\n", "and the spacing positive"),
        ("0,0.1\n", "its columns must be X, Y, spacing, in metres, got 2 columns"),
        ("X,spacing\n0,0.1\n", "must be X, Y, spacing, in metres, got the heading 'X,spacing'"),
        ("x,y,h\n0,0,0.1\n", "got the heading 'x,y,h'"),
        ("0,0,0.1\n0,b,0.1\n", "could not convert string 'b'"),
        ("0,0,0.1\n0,0.1\n", "columns changed from 3 to 2"),
        ("0,0,1e-9\n", "it varies for some"),
        ("0,0,1e-4\n1,0,0.1\n", "a factor of 100"),
    ],
)
def test_a_wrong_file_is_answered_by_one_sentence(text: str, message: str, tmp_path: Path) -> None:
    wrong = body(tmp_path, text)
    with pytest.raises(SceneError, match=message) as told:
        field(wrong)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("spacing", "message"),
    [
        ({"file": "nowhere.csv"}, "'nowhere.csv' cannot be read"),
        ({"file": 7}, "file must be the name of a file, got 7"),
        ({"fil": "spacing.csv"}, r"or \{file = ...\}, maybe with a factor"),
        ({"file": "spacing.csv", "factor": -1.0}, "factor must be positive and finite, got -1.0"),
        ({"file": "spacing.csv", "factor": True}, "factor must be positive and finite, got True"),
    ],
)
def test_a_wrong_table_is_answered_by_one_sentence(spacing: Any, message: str) -> None:
    builder = Simulation.builder().body("plate", shape=BOXES[2], spacing=spacing)
    with pytest.raises(BuildError, match=message) as told:
        builder.material("neo-hookean", **SOFT).duration(1e-3).build()
    assert str(told.value).count("\n") == 1  # below what it is of


def test_a_study_knows_files_by_what_they_hold(tmp_path: Path) -> None:
    text = "0,0,0.1\n0.5,0,0.1\n0,0.5,0.1\n0.5,0.5,0.1\n1,0.25,{}\n"
    listed = body(tmp_path, text.format(0.12))
    builder = Simulation.builder().body("plate", shape=listed.shape, spacing=listed.spacing)
    scene = builder.material("neo-hookean", **SOFT).duration(1e-3).scene()
    case = SceneCase(scene, [], spacing=0.1)
    key = Task(case).key
    assert Task(case).key == key
    body(tmp_path, text.format(0.14))  # the least spacing is the same
    assert Task(case).key != key
