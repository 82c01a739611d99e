"""The compiled pass of heat flow beside the product of matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array
from scipy.spatial import cKDTree

from solidsph import Simulation
from solidsph_builtin.effects import heat
from solidsph_builtin.effects._heat_flow import HeatFlow

RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}


def conduction(jitter: float, rng: np.random.Generator) -> csr_array:
    """K between the particles of a lattice, in order or out of it."""
    X = np.stack(np.meshgrid(*map(np.arange, (9, 7, 5)), indexing="ij"), axis=-1).reshape(-1, 3)
    X = X + jitter * rng.standard_normal(X.shape)
    near = cKDTree(X).sparse_distance_matrix(cKDTree(X), 2.1).tocoo()
    K = csr_array((np.exp(-near.data) * (near.data > 0.0), (near.row, near.col)))
    K.eliminate_zeros()
    return csr_array(K - diags_array(np.asarray(K.sum(axis=1)), format="csr"))


@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_flow_is_the_product_and_conserves_heat(jitter):
    rng = np.random.default_rng(0)
    K = conduction(jitter, rng)
    flow = HeatFlow.of(K)
    for _ in range(2):  # nothing is left over from the first time
        T = rng.standard_normal(K.shape[0])
        found = flow @ T
        # Sums of some tens of numbers, in another order.
        np.testing.assert_allclose(found, K @ T, rtol=0.0, atol=1e-13 * np.abs(K @ T).max())
        assert abs(found.sum()) < 1e-14 * np.abs(found).sum()


def test_a_large_body_conducts_as_a_small_one_does(monkeypatch):
    def warmed():
        simulation = (
            Simulation.builder()
            .body("plate", shape={"type": "box", "lengths": [1.0, 0.5]}, spacing=0.05)
            .material("neo-hookean", **RUBBER)
            .effect("heat", conductivity=50.0, heat_capacity=500.0, initial="100*sin(4*X)")
            .duration(1.0)
            .build()
        )
        (term,) = [t for t in simulation.terms if hasattr(t, "conduction")]
        state = simulation.time_loop().advance(simulation.start(), 5)
        return type(term._flow), term.temperature(state.memory)

    few, expected = warmed()
    monkeypatch.setattr(heat, "_MANY", 1)
    many, found = warmed()
    assert (few, many) == (csr_array, HeatFlow)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-11)
