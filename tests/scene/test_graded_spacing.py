"""A spacing that varies, as scenes state it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, SceneError, Simulation
from solidsph.model.spacing import STEEPEST, cells_over
from solidsph.registry.construct import construct
from solidsph.scene.graded_spacing import least_spacing, predicted_count, scaled, spacing_field
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import BodyScene
from solidsph.studies.scene_words import changed, smallest_spacing
from tests.helpers.scenes import SOFT

SHEET = {
    "type": "difference",
    "of": {"type": "box", "lengths": [2.0, 2.0], "origin": [-1.0, -1.0]},
    "minus": {"hole": {"type": "disc", "radius": 0.2}},
}
AT_RIM = {"where": "hole.rim", "spacing": 0.02, "over": 0.5}


def body(spacing: float | str, *refine: dict[str, Any], shape: Any = SHEET) -> BodyScene:
    return BodyScene(shape, spacing, refine=refine)


def field(spacing: float | str, *refine: dict[str, Any], shape: Any = SHEET) -> Any:
    return spacing_field(body(spacing, *refine, shape=shape), construct("shapes", shape))


def scene(spacing: float | str, *refine: dict[str, Any], **words: Any) -> SceneBuilder:
    builder = Simulation.builder().body("sheet", shape=SHEET, spacing=spacing, refine=refine)
    for name, value in words.items():
        builder = getattr(builder, name)(value)
    return builder.material("neo-hookean", **SOFT).duration(1e-3)


def test_a_formula_is_the_spacing_where_it_is_read() -> None:
    found = field("0.02 + 0.1*hypot(X, Y)")
    X = np.array([[0.2, 0.0], [-1.0, 1.0], [0.5, -0.5]])
    np.testing.assert_allclose(found.at(X), 0.02 + 0.1 * np.hypot(*X.T), rtol=1e-12)
    assert found.least == pytest.approx(0.04, rel=0.02)  # on the rim, up to a cell
    assert found.greatest == pytest.approx(0.02 + 0.1 * np.sqrt(2.0), rel=0.05)


def test_a_face_is_refined_and_the_own_spacing_returns() -> None:
    found = field(0.1, AT_RIM)
    way = np.linspace(0.0, 0.79, 80)
    s = found.at(np.column_stack([0.2 + way, np.zeros(80)]))
    assert s[0] == pytest.approx(0.02, rel=1e-3)
    assert np.all(s[way > 0.51] == 0.1)
    assert np.all(np.diff(s) >= -1e-9)
    assert np.max(np.diff(s) / np.diff(way)) <= STEEPEST


def test_several_places_are_refined_by_the_finest() -> None:
    corner = {"where": "X > 0.9 and Y > 0.9", "spacing": 0.05, "over": 0.3}
    found = field(0.1, AT_RIM, corner)
    s = found.at(np.array([[0.2, 0.0], [0.99, 0.99], [-0.9, -0.9]]))
    np.testing.assert_allclose(s, [0.02, 0.05, 0.1], rtol=0.01)


def test_the_number_of_particles_is_foreseen() -> None:
    built = scene(0.1, AT_RIM).build()
    expected = predicted_count(field(0.1, AT_RIM), construct("shapes", SHEET))
    # Repulsion leaves out some that come too close: measured 2 % off.
    assert built.particles.count == pytest.approx(expected, rel=0.05)


def test_what_is_written_is_read_again() -> None:
    wanted = scene("0.05 + 0.1*abs(X)", AT_RIM).scene()
    assert Scene.from_toml(wanted.to_toml()) == wanted
    text = wanted.to_toml().replace('"hole.rim"', "7")
    with pytest.raises(BuildError, match="where must be a face or a condition, got 7"):
        Simulation.builder(Scene.from_toml(text)).build()


def test_a_study_scales_all_of_it() -> None:
    wanted = scene("0.05 + 0.1*abs(X)", AT_RIM).scene()
    finer = changed(wanted, "spacing", 0.5 * smallest_spacing(wanted))
    assert smallest_spacing(finer) == pytest.approx(0.5 * smallest_spacing(wanted), rel=1e-6)
    assert least_spacing(scaled(body(0.1, AT_RIM), 0.5)) == pytest.approx(0.01)
    coarser = scaled(body(0.1, AT_RIM), 3.0)
    assert spacing_field(coarser, construct("shapes", SHEET)).least == pytest.approx(0.06, rel=1e-2)
    X = np.array([[0.3, 0.4], [0.9, 0.1]])
    half = spacing_field(finer.bodies["sheet"], construct("shapes", SHEET)).at(X)
    whole = spacing_field(wanted.bodies["sheet"], construct("shapes", SHEET)).at(X)
    # The distance from the rim is that from samples of it, which are finer.
    np.testing.assert_allclose(half, 0.5 * whole, rtol=1e-4)


@pytest.mark.parametrize(
    ("spacing", "refine", "message"),
    [
        ("X", [], "the spacing is -.* it must be positive"),
        ("1e-9", [], "it varies for some"),
        ("0.001 + 0.5*hypot(X, Y)", [{**AT_RIM, "spacing": 1e-4}], "a factor of 100|grows"),
        ("0.1 + 0.9*abs(X)", [], r"grows by 0\.9 m per metre"),
        ("0.1 + t", [], "unknown name 't'"),
        (0.1, [{**AT_RIM, "over": 0.1}], "use over = 0.3 or more"),
        (0.1, [{**AT_RIM, "spacing": 0.2}], "above the largest of the body"),
        (0.1, [{**AT_RIM, "spacing": -1.0}], "spacing must be a positive finite length"),
        (0.1, [{**AT_RIM, "where": "rom"}], "rom.*neither a tag nor a condition"),
        (0.1, [{**AT_RIM, "where": "X > 7"}], "matches no particle"),
        (0.1, [{"where": "hole.rim"}], "each entry is"),
        (-0.1, [AT_RIM], "spacing must be a positive finite length"),
    ],
)
def test_mistakes_are_answered_by_one_sentence(
    spacing: float | str, refine: list[dict[str, Any]], message: str
) -> None:
    with pytest.raises(SceneError, match=message):
        field(spacing, *refine)
    with pytest.raises(BuildError, match=message):
        scene(spacing, *refine).build()


def test_a_discretisation_that_cannot_follow_names_those_that_can() -> None:
    builder = Simulation.builder().body(
        "sheet", shape=SHEET, spacing="0.1 + 0.1*X**2", discretisation="lattice"
    )
    with pytest.raises(BuildError, match=r"'lattice' does not follow; use .*'fitted'.*'points'"):
        builder.material("neo-hookean", **SOFT).duration(1.0).build()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"formulation": "updated-lagrangian"}, "use the formulation 'total-lagrangian'"),
    ],
)
def test_what_cannot_follow_is_refused(words: dict[str, Any], message: str) -> None:
    with pytest.raises(BuildError, match=message):
        scene(0.1, {**AT_RIM, "spacing": 0.05}, **words).build()


def test_cells_fill_the_box_and_are_no_larger_than_the_spacing() -> None:
    lower, upper = np.array([0.0, -1.0]), np.array([2.0, 0.5])
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    cells = cells_over(
        lower,
        upper,
        lambda X: 0.05 + 0.2 * np.abs(X[:, 0]),
        lambda X, reach: np.all(np.abs(X - middle) < half + reach[:, None], axis=1),
        0.5,
    )
    s = 0.05 + 0.2 * np.abs(cells.centres[:, 0])
    assert np.all(cells.sizes <= 0.5 * s)
    inside = np.all((cells.centres > lower) & (cells.centres < upper), axis=1)
    # The last cells of a row reach beyond the box by less than one of them.
    assert cells.volumes[inside].sum() == pytest.approx(3.0, rel=0.05)
