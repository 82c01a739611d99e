"""Result.at and Record.at: fields at any points of the undeformed bodies."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Record, RecordError, SceneError, Simulation
from solidsph.model.particles import State
from tests.helpers.scenes import SOFT, box, touching

SLOT = {
    "type": "difference",
    "of": {"type": "box", "lengths": [1.0, 1.0]},
    # Narrower than a spacing, open at the right.
    "minus": {"type": "box", "lengths": [0.7, 0.01], "origin": [0.4, 0.495]},
}
HOLE = {
    "type": "difference",
    "of": {"type": "box", "lengths": [1.0, 1.0]},
    "minus": {"type": "disc", "radius": 0.2, "centre": [0.5, 0.5]},
}


def built(shape: Any, cells: int = 10, **body: Any) -> Simulation:
    return (
        Simulation.builder()
        .scheme("corrected")  # cells: no row of particles along the middle
        .body("block", shape=shape, spacing=1.0 / cells, **body)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", **SOFT)
        .duration(1e-3)
        .build()
    )


def moved(simulation: Simulation, displacements: Any, velocities: Any = 0.0) -> State:
    state = simulation.initial
    return attrs.evolve(
        state,
        positions=state.positions + displacements,
        velocities=np.zeros_like(state.positions) + velocities,
    )


@pytest.mark.parametrize("d", [1, 2, 3])
def test_quadratic_motions_are_exact(d: int) -> None:
    random = np.random.default_rng(d)
    simulation = box(d, 6).build()
    B = 0.05 * random.normal(size=(d, d))
    A = 0.05 * random.normal(size=(d, d, d))

    def u(X: np.ndarray) -> np.ndarray:
        return X @ B.T + np.einsum("ijk,nj,nk->ni", A, X, X)

    X = simulation.particles.positions
    points = np.concatenate([random.uniform(size=(40, d)), np.zeros((1, d)), np.ones((1, d))])
    values = simulation.values_at(moved(simulation, u(X), 3.0 * u(X)), points)
    F = np.eye(d) + B + np.einsum("ijk,nk->nij", A + A.swapaxes(1, 2), points)
    # Rounding, and the extrapolation over half a spacing.
    assert values.displacement == pytest.approx(u(points), abs=1e-13)
    assert values.velocity == pytest.approx(3.0 * u(points), abs=1e-13)
    assert pytest.approx(F, abs=1e-12) == values.F
    assert np.array_equal(values.points, points)


def test_stress_is_that_of_the_particles() -> None:
    """Uniform where F is, and P F^T / J of a law that is written out here."""
    simulation = box(2, 6, discretisation={"type": "lattice"}).build()
    F = np.array([[1.1, 0.05], [0.0, 0.95]])
    X = simulation.particles.positions
    values = simulation.values_at(moved(simulation, X @ (F - np.eye(2)).T), [[1.0, 1.0], [0.3, 0]])
    E, nu = SOFT["youngs_modulus"], SOFT["poissons_ratio"]
    lam, mu, J = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu)), np.linalg.det(F)
    sigma = (mu * (F @ F.T - np.eye(2)) + lam * np.log(J) * np.eye(2)) / J
    assert values.stress == pytest.approx(np.tile(sigma, (2, 1, 1)), rel=1e-10)


@pytest.mark.parametrize("discretisation", ["lattice", "conforming-lattice"])
def test_a_hole_is_reached_up_to_its_rim(discretisation: str) -> None:
    simulation = built(HOLE, 16, discretisation=discretisation)
    X = simulation.particles.positions
    angle = np.linspace(0.0, 2.0 * np.pi, 50)
    rim = 0.5 + 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    values = simulation.values_at(moved(simulation, X**2), rim)
    assert values.displacement == pytest.approx(rim**2, abs=1e-12)


def test_values_do_not_mix_across_a_slot() -> None:
    simulation = built(SLOT)
    above = simulation.particles.positions[:, 1] > 0.5
    state = moved(simulation, np.where(above[:, None], 0.01, -0.01))
    x = np.linspace(0.75, 1.0, 6)
    upper = simulation.values_at(state, np.stack([x, np.full(6, 0.505)], axis=1))
    lower = simulation.values_at(state, np.stack([x, np.full(6, 0.495)], axis=1))
    assert upper.displacement == pytest.approx(np.full((6, 2), 0.01), abs=1e-14)
    assert lower.displacement == pytest.approx(np.full((6, 2), -0.01), abs=1e-14)
    # Ahead of the slot the sides see each other.
    ahead = simulation.values_at(state, [[0.2, 0.5]]).displacement
    assert abs(ahead).max() < 0.005


def test_bodies_that_touch_are_told_apart() -> None:
    simulation = touching(2).build()
    X = simulation.particles.positions
    first = simulation.particles.bodies["block"]
    u = np.zeros_like(X)
    u[first] = 0.25
    state = moved(simulation, u)
    assert simulation.values_at(state, [1.0, 0.5], "block").displacement == pytest.approx(0.25)
    assert simulation.values_at(state, [1.0, 0.5], "other").displacement == pytest.approx(0.0)
    inside = simulation.values_at(state, [[0.9, 0.5], [1.1, 0.5]]).displacement
    assert inside == pytest.approx(np.array([[0.25, 0.25], [0.0, 0.0]]))


@pytest.mark.parametrize(
    ("points", "body", "message"),
    [
        ([[0.5, 0.5], [0.5, 1.2]], None, r"the point \[0.5, 1.2\] lies outside .* 0.2 m from"),
        ([[2.5, 0.5], [0.5, 1.2]], None, r"\[2.5, 0.5\], and 1 more points, lies outside"),
        ([0.5, 0.5], "other", r"outside of body 'other', at least 0.5 m"),
        ([0.5, 0.5], "third", "there is no body 'third'; bodies: block, other"),
        ([0.5, 0.5, 0.5], None, r"\(m, 2\) in metres, finite, got \[0.5, 0.5, 0.5\]"),
        ([[0.5, np.nan]], None, "finite, got"),
        ("tip", None, "got tip"),
        ([], None, r"got \[\]"),
    ],
)
def test_points_elsewhere_are_refused(points: Any, body: str | None, message: str) -> None:
    simulation = touching(2).build()
    with pytest.raises(SceneError, match=message):
        simulation.values_at(simulation.initial, points, body)


def pulled() -> Any:
    return (
        box(2, 6)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": "1e4*min(t/1e-3, 1)"})
        .outputs(4)
    )


def test_a_record_says_the_same_as_the_result(tmp_path: Path) -> None:
    result = pulled().build().run(record=tmp_path / "record.h5")
    points = [[1.0, 1.0], [0.25, 0.0], [0.5, 0.5]]
    live = result.at(points)
    assert np.abs(live.displacement).max() > 1e-4
    with Record(tmp_path / "record.h5") as record:
        kept = record.at(points)
        for name in ("displacement", "velocity", "F", "stress"):
            assert np.array_equal(getattr(kept, name), getattr(live, name)), name
        assert not record.at(points, 0).displacement.any()
        assert np.array_equal(record.at(points, 4).stress, kept.stress)
        with pytest.raises(SceneError, match="lies outside"):
            record.at([2.0, 0.5])


def test_a_record_of_python_objects_has_no_shapes(tmp_path: Path) -> None:
    builder = box(2, 4).initial(where=lambda X: X[:, 0] > 0.5, velocity={"x": 0.1}).duration(1e-4)
    result = builder.outputs(1).build().run(record=tmp_path / "record.h5")
    assert result.at([0.5, 0.5]).velocity.shape == (1, 2)
    with (
        Record(tmp_path / "record.h5") as record,
        pytest.raises(RecordError, match="ask the Result"),
    ):
        record.at([0.5, 0.5])


def test_a_result_from_another_process_says_where_to_look() -> None:
    result = box(2, 4).duration(1e-4).build().run()
    sent = pickle.loads(pickle.dumps(result))
    assert np.array_equal(sent.state.positions, result.state.positions)
    with pytest.raises(SceneError, match=r"Record\.at"):
        sent.at([0.5, 0.5])
