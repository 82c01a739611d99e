"""How good particles are, as `solidsph explain` tells it."""

from __future__ import annotations

import json
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph.commands.quality import quality_rows
from solidsph.simulation import Simulation
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML, SOFT


def square() -> Simulation:
    corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    scene = Simulation.builder().body(
        "block", shape={"type": "polygon", "vertices": corners}, spacing=0.1
    )
    return scene.material("neo-hookean", **SOFT).duration(1.0).build()


def with_positions(simulation: Simulation, move: Any) -> Simulation:
    """The same with its particles elsewhere."""
    (body,) = simulation.model.bodies
    particles = attrs.evolve(body.particles, positions=move(body.particles.positions))
    body = attrs.evolve(body, particles=particles)
    return attrs.evolve(simulation, model=attrs.evolve(simulation.model, bodies=[body]))


def test_a_lattice_on_the_boundary_is_exact() -> None:
    (row,) = quality_rows(square())
    nearest = [row[f"nearest, {which}"] for which in ("least", "median", "greatest")]
    assert nearest == pytest.approx([1.0, 1.0, 1.0], rel=1e-12)  # rounding of coordinates
    assert abs(row["off the surface"]) < 1e-12
    assert [row[k] for k in ("volume", "centroid", "second moments")] == pytest.approx(
        [0.0, 0.0, 0.0], abs=1e-12
    )


def test_particles_that_are_moved_are_told() -> None:
    (row,) = quality_rows(with_positions(square(), lambda X: X + np.array([0.02, 0.0])))
    assert row["off the surface"] == pytest.approx(0.2)
    assert row["centroid"] == pytest.approx(0.2)
    assert row["second moments"] == pytest.approx(0.0, abs=1e-12)  # about their own centroid
    (row,) = quality_rows(with_positions(square(), lambda X: X * [1.1, 1.0]))
    assert row["nearest, least"] == pytest.approx(1.0)
    # Moments of a unit square: 1/12 each; 1.1^2 of the first.
    assert row["second moments"] == pytest.approx((1.1**2 - 1.0) / 2.0)
    (row,) = quality_rows(with_positions(square(), lambda X: X * 1.1))
    assert row["nearest, greatest"] == pytest.approx(1.1)


def test_explain_tells_them(tmp_path: Any) -> None:
    (tmp_path / "s.toml").write_text(SCENE_TOML)
    done = solidsph("explain", "s.toml", "--json", cwd=tmp_path)
    (row,) = json.loads(done.stdout)["scenes"]["s.toml"]["particles"]
    assert row["body"] == "block"
    assert row["volume"] == pytest.approx(0.0, abs=1e-12)
    assert row["centroid"] is None  # a box tells no moments
    assert "second moments off by" in solidsph("explain", "s.toml", cwd=tmp_path).stdout
    assert np.isfinite(row["nearest, median"])
