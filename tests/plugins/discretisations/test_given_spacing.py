"""Points that come with the spacing of each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Simulation
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.scene.graded_spacing import scaled
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.discretisations._point_spacing import spacing_of_points
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.discretisations.points import Points
from solidsph_builtin.effects._gradients import BodyGradient
from solidsph_builtin.shapes.box import Box
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SOFT

AXES = ("x", "y", "z")
BODIES: dict[str, tuple[dict[str, Any], str]] = {
    "interval": ({"type": "interval", "length": 1.0}, "0.02 + 0.1*X"),
    "disc": ({"type": "disc", "radius": 1.0}, "0.05 + 0.2*hypot(X, Y)"),
    "cube": ({"type": "box", "lengths": [0.6, 0.6, 0.6]}, "0.06 + 0.1*X"),
}
MOMENTS = {1: (1.0, 0.5), 2: (np.pi, 0.0), 3: (0.216, 0.3)}
"""Volume and coordinates of the centroid, by dimension."""


def made(shape: dict[str, Any], spacing: str, discretisation: Any) -> Body:
    builder = Simulation.builder().body(
        "block", shape=shape, spacing=spacing, discretisation=discretisation
    )
    return builder.material("neo-hookean", **SOFT).duration(1e-3).build().model.bodies[0]


@pytest.fixture(scope="module", params=list(BODIES))
def clouds(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Body, Body]:
    """A body by a formula, and one of its points in a file."""
    shape, formula = BODIES[request.param]
    one = made(shape, formula, "fitted")
    p = one.particles
    path = tmp_path_factory.mktemp("cloud") / "cloud.csv"
    rows = np.column_stack([p.positions, p.spacings])
    np.savetxt(path, rows, "%.17g", delimiter=",", header="x, y, z, spacing")
    columns = [*AXES[: p.dimension], "spacing"]
    points = {"type": "points", "file": str(path), "columns": columns}
    return one, made(shape, "given", points)


def test_the_supports_are_those_of_the_file(clouds: tuple[Body, Body]) -> None:
    one, other = clouds
    np.testing.assert_array_equal(other.particles.positions, one.particles.positions)
    np.testing.assert_array_equal(other.particles.spacings, one.particles.spacings)
    np.testing.assert_array_equal(other.radii, one.radii)
    assert np.ptp(other.radii) > 0.3 * other.radii.max()


def test_volumes_integrate_polynomials(clouds: tuple[Body, Body]) -> None:
    p = clouds[1].particles
    volume, middle = MOMENTS[clouds[1].shape.dimension]
    assert p.volumes.sum() == pytest.approx(volume, rel=1e-10)
    # Of numbers below 1, by a correction that is exact to rounding.
    np.testing.assert_allclose(p.volumes @ p.positions, volume * middle, atol=1e-10)


def test_linear_fields_have_their_gradient(clouds: tuple[Body, Body]) -> None:
    body = clouds[1]
    d = body.particles.dimension
    A = np.random.default_rng(1).normal(size=(d, d))
    found = BodyGradient.of(body).gradient(body.particles.positions @ A.T)
    # Of numbers near 1, divided by the least spacing.
    assert np.abs(found - A[:, :, None]).max() < 1e-8


def test_a_uniform_stress_is_in_balance_with_its_loads(clouds: tuple[Body, Body]) -> None:
    assert left_of_a_uniform_stress(clouds[1]) < 1e-8  # as where a formula says the spacing


@pytest.mark.parametrize(
    ("shape", "spacing", "moved", "allowed"),
    [
        # Gaps of 1.8 spacings leave too few neighbours on a line.
        ({"type": "interval", "length": 1.0}, 0.05, 0.3, 1e-8),
        ({"type": "disc", "radius": 0.5}, 0.08, 0.4, 1e-8),
        ({"type": "box", "lengths": [0.6, 0.6]}, 0.06, 0.4, 1e-8),
        # As far as the sums of `consistent` are iterated in space.
        ({"type": "ball", "radius": 0.5}, 0.12, 0.4, 1e-6),
        ({"type": "cylinder", "radius": 0.3, "length": 0.8}, 0.1, 0.4, 1e-6),
    ],
)
def test_scattered_points_with_one_spacing_balance_it_too(
    shape: dict[str, Any], spacing: float, moved: float, allowed: float
) -> None:
    """Points inside are moved at random, by parts of the spacing: some are then nearer to the
    surface than those on it."""
    even = made(shape, spacing, "fitted")
    X = even.particles.positions.copy()
    inner = even.shape.signed_distance(X) < -0.6 * spacing
    X[inner] += np.random.default_rng(0).uniform(-moved, moved, X[inner].shape) * spacing
    X = X[even.shape.signed_distance(X) < 1e-9]
    body = made(shape, spacing, {"type": "points", "positions": X.tolist()})
    assert left_of_a_uniform_stress(body) < allowed


def left_of_a_uniform_stress(body: Body) -> float:
    """The largest force that is left where a uniform stress meets its tractions, over the largest
    of these."""
    p, gradient = body.particles, BodyGradient.of(body)
    d = p.dimension
    A = np.random.default_rng(2).normal(size=(d, d))
    stress = np.repeat((A + A.T)[:, :, None], p.count, axis=2)
    loads = np.einsum("ijn,nj->ni", stress, p.area_vectors)
    left = gradient.forces(stress) + loads
    return float(np.abs(left).max() / np.abs(loads).max())


SQUARE = {"type": "box", "lengths": [1.0, 1.0]}
STEP = 0.125


def grid(spacing: Callable[[Array], Any] = lambda X: STEP) -> Array:
    """Nine by nine points of a square, with the spacing of each, (81, 3)."""
    axis = np.linspace(0.0, 1.0, 9)
    X = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.column_stack([X, np.broadcast_to(spacing(X), len(X))])


def points(rows: Any, columns: Any = ("x", "y", "spacing"), **further: Any) -> dict[str, Any]:
    return {"type": "points", "positions": rows, "columns": list(columns), **further}


def test_equal_spacings_are_one_spacing() -> None:
    body = made(SQUARE, "given", points(grid()))
    assert body.smoothing.radii is None
    assert np.all(body.particles.spacings == STEP)


def test_columns_have_any_order_and_may_hold_volumes() -> None:
    rows = np.column_stack([np.full(81, 1.0 / 81.0), grid()])[:, [2, 0, 3, 1]]
    p = made(SQUARE, "given", points(rows, ["y", "volume", "spacing", "x"])).particles
    np.testing.assert_array_equal(p.positions, grid()[:, :2])
    assert np.all(p.volumes == 1.0 / 81.0)


def test_volumes_may_be_a_column_without_spacings() -> None:
    rows = np.column_stack([grid()[:, :2], np.full(81, 1.0 / 81.0)])
    shape = Box([1.0, 1.0])
    p: Particles = Points(rows, columns=["x", "y", "volume"]).particles(shape, STEP)
    assert np.all(p.volumes == 1.0 / 81.0)
    assert np.all(p.spacings == STEP)


def test_between_points_it_is_between_their_spacings() -> None:
    X, s = grid()[:, :2], STEP * (1.0 + 0.5 * grid()[:, 0])
    field = spacing_of_points(Fitted(), X, s)
    at = np.random.default_rng(3).uniform(size=(500, 2))
    np.testing.assert_array_equal(field.at(X), s)
    # A weighted mean of the points within two steps, in which s changes by 0.5 STEP a metre.
    assert np.abs(field.at(at) - STEP * (1.0 + 0.5 * at[:, 0])).max() < 0.5 * STEP * 2.0 * STEP
    assert (field.least, field.greatest) == (STEP, 1.5 * STEP)
    alone = spacing_of_points(Fitted(), X[:1], s[:1])
    np.testing.assert_array_equal(alone.at(at), np.full(500, STEP))


def changed(row: int, column: int, value: float) -> Array:
    rows = grid()
    rows[row, column] = value
    return rows


@pytest.mark.parametrize(
    ("discretisation", "says"),
    [
        (points(changed(3, 2, -0.1)), "the spacing of point 3 is -0.1 m; it must be positive"),
        (points(changed(3, 2, 0.0)), r"point 3 is 0 m; it must be positive \(1 of 81 are not\)"),
        (points(changed(3, 2, np.nan)), "row 3 of the positions is not finite: .*nan"),
        (points(changed(3, 2, 2.0 * STEP)), "grows from 0.125 m at point .* to 0.25 m at point 3"),
        (points(changed(3, 2, 1e-4)), "spacings are 0.0001 to 0.125 m; they may vary by .* 100"),
        (points(grid(lambda X: 1e3 * STEP)), "0.001 of their spacings apart .* check the unit"),
        (points(grid(), ["x", "y", "size"]), "columns are a list of x, y, z, spacing, volume"),
        (points(grid(), ["x", "spacing"]), "columns must name x and y, as the shape has"),
        (points(grid(), ["x", "x", "spacing"]), "columns names one twice: x, x, spacing"),
        (points(grid(), ["x", "z", "spacing"]), "columns must name x and y, .* no other coord"),
        (points(grid()[:, :2]), "the rows must have the 3 columns x, y, spacing, got .*81, 2"),
        (points(grid(), ["x", "y", "volume"], volumes=[1.0] * 81), "volumes are given twice"),
        (points(grid(), ["x", "y", "volume"]), "needs particles that come with spacings"),
        ("fitted", "needs particles that come with spacings, such as 'points'"),
        (None, "needs particles that come with spacings"),
        ("lattice", "which the discretisation 'lattice' does not follow"),
        ({"type": "fitted-moments", "of": "lattice"}, "needs particles that come with spacings"),
    ],
)
def test_wrong_spacings_are_told_in_a_line(discretisation: Any, says: str) -> None:
    with pytest.raises(BuildError, match=says) as told:
        made(SQUARE, "given", discretisation)
    assert len(told.value.problems) == 1


def test_steep_spacings_that_are_allowed() -> None:
    """Growth by a little less than half a metre a metre, along an axis; a little more is not."""
    made(SQUARE, "given", points(grid(lambda X: STEP * (1.0 + 0.49 * X[:, 0] / STEP))))
    with pytest.raises(BuildError, match=r"0\.52 m per metre"):
        made(SQUARE, "given", points(grid(lambda X: STEP * (1.0 + 0.52 * X[:, 0] / STEP))))


@pytest.mark.parametrize("spacing", [0.125, "0.1 + 0.1*X"])
def test_a_spacing_beside_that_of_the_points_is_refused(spacing: Any) -> None:
    with pytest.raises(BuildError, match='give it spacing = "given", or leave out the column'):
        made(SQUARE, spacing, points(grid()))


def test_moments_are_fitted_to_points_with_spacings() -> None:
    rows = grid(lambda X: STEP * (1.0 + 0.5 * X[:, 0]))
    p = made(SQUARE, "given", {"type": "fitted-moments", "of": points(rows)}).particles
    np.testing.assert_array_equal(p.spacings, rows[:, 2])


def test_they_are_neither_refined_nor_made_coarser() -> None:
    builder: SceneBuilder = Simulation.builder().body(
        "block", shape=SQUARE, spacing="given", discretisation=points(grid())
    )
    (body,) = builder.duration(1.0).scene().bodies.values()
    assert scaled(body, 1.0) is body
    with pytest.raises(SceneError, match=r"cannot be 0\.5 times as large; give a spacing in m"):
        scaled(body, 0.5)
    refined = attrs.evolve(body, refine=({"where": "left", "spacing": 0.05, "over": 0.5},))
    builder = Simulation.builder(attrs.evolve(builder.scene(), bodies={"block": refined}))
    with pytest.raises(BuildError, match="leave refine out"):
        builder.material("neo-hookean", **SOFT).build()


SCENE = """
duration = 1e-3
[body.block]
spacing = "given"
shape = {type = "box", lengths = [1.0, 1.0]}
discretisation = {type = "points", file = "cloud.txt", columns = ["x", "y", "spacing"]}
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
"""


def test_a_scene_reads_them_from_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "cloud.toml").write_text(SCENE)
    np.savetxt(folder / "cloud.txt", grid(lambda X: STEP * (1.0 + 0.5 * X[:, 1])))
    done = solidsph("explain", "scenes/cloud.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0.125 to 0.1875" in done.stdout
    np.savetxt(folder / "cloud.txt", changed(3, 2, -1.0))
    done = solidsph("explain", "scenes/cloud.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 2  # and that the simulation cannot be built
    assert "the spacing of point 3 is -1 m" in done.stderr
