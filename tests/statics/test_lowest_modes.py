"""Natural frequencies by iteration against those by a factorisation, and against a dense matrix."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solidsph import Simulation
from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium, frequencies
from solidsph.statics.lowest import lowest_modes
from tests.helpers.scenes import SOFT


def beam(d: int, nu: float) -> SceneBuilder:
    return (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [3.0, 1.2, 1.0][:d]}, spacing=0.25)
        .material("neo-hookean", **{**SOFT, "poissons_ratio": nu})
        .duration(1.0)
    )


def both(simulation: Simulation, count: int, rigid: int = 0) -> tuple[Array, Array]:
    direct, iterated = (
        frequencies(simulation, count, solver=solver) for solver in ("direct", "iterative")
    )
    # The rigid motions share a frequency: any of their sums is a mode.
    assert iterated.smoothness[rigid:] == pytest.approx(direct.smoothness[rigid:], abs=1e-4)
    return direct.angular_frequencies, iterated.angular_frequencies


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_frequencies_by_iteration_are_those_of_a_factorisation(d: int, nu: float) -> None:
    direct, iterated = both(beam(d, nu).boundary("clamp", where="left").build(), 5)
    # The squares are known to 1e-11, and the scale of the highest is some hundred times the lowest.
    assert iterated == pytest.approx(direct, rel=1e-8)


def test_a_free_body_has_six_rigid_motions() -> None:
    direct, iterated = both(beam(3, 0.3).build(), 9, rigid=6)
    assert iterated[6:] == pytest.approx(direct[6:], rel=1e-8)
    assert np.all(iterated[:6] < 1e-4 * iterated[6])


def test_frequencies_under_a_load_that_follows() -> None:
    scene = beam(2, 0.3).boundary("clamp", where="left")
    simulation = scene.boundary("pressure", where="top", pressure=4e3).build()
    state = equilibrium(simulation).state
    direct, iterated = (
        frequencies(simulation, 4, state, solver).angular_frequencies
        for solver in ("direct", "iterative")
    )
    assert iterated == pytest.approx(direct, rel=1e-8)
    assert abs(direct[0] / frequencies(simulation, 4).angular_frequencies[0] - 1.0) > 1e-3


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_an_unstable_state_has_no_frequencies(solver: str) -> None:
    """Twice the load under which a column of length L buckles, pi^2 E' I / (4 L^2) (Euler)."""
    slender, modulus = 10.0, 1e6 / (1.0 - 0.3**2)
    euler = np.pi**2 * modulus / 12.0 / (4.0 * slender**2)
    simulation = (
        Simulation.builder()
        .body("strip", shape={"type": "box", "lengths": [slender, 1.0]}, spacing=0.2)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": -2.0 * euler})
        .duration(1.0)
        .build()
    )
    state = equilibrium(simulation).state
    with pytest.raises(SolidsphError, match="unstable"):
        frequencies(simulation, 1, state, solver)


@settings(max_examples=20)
@given(
    size=st.integers(2, 60), count=st.integers(1, 6), seed=st.integers(0, 99), shared=st.booleans()
)
def test_modes_of_any_matrix(size: int, count: int, seed: int, shared: bool) -> None:
    """Also if several share a frequency, or the modes asked for are nearly all."""
    count = min(count, size)
    random = np.random.default_rng(seed)
    squares = np.sort(random.uniform(1.0, 100.0, size))
    if shared:
        squares[: size // 2] = squares[0]
    masses = random.uniform(0.5, 2.0, size)
    Q = np.linalg.qr(random.standard_normal((size, size)))[0] * np.sqrt(masses)[:, None]
    K = Q @ np.diag(squares) @ Q.T
    diagonal = K.diagonal()
    found, modes = lowest_modes(lambda x: K @ x, lambda f: f / diagonal, masses, count)
    assert found == pytest.approx(squares[:count], rel=1e-8)
    assert modes.T @ (masses[:, None] * modes) == pytest.approx(np.eye(count), abs=1e-9)
