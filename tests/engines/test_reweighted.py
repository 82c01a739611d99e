"""Forces with other weights at some particles agree with products of matrices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from solidsph.engines.compiled.engine import CompiledEngine
from solidsph.engines.matrix import MatrixEngine, assembled, fixed_forces
from solidsph.interfaces.body import Body
from solidsph.interfaces.row_weights import RowWeights
from solidsph.maths.arrays import Array, Mask
from tests.engines.test_engines import ARRANGEMENTS, ROUNDING, block
from tests.helpers.examples import examples


def changed(body: Body, chosen: Mask, rng: np.random.Generator) -> tuple[RowWeights, Array]:
    """Random weights of the chosen particles (n,), of some of their pairs; and those of all."""
    pairs = body.pairs()
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    weights = body.formulation.gradient.weights(pairs, kernel_gradients, body.particles.cells)
    where, rows = pairs.chosen(np.flatnonzero(chosen))
    kept = (rng.random(rows.count) < 0.7) | (rows.rows == rows.columns)
    weights[where] *= rng.normal(size=(rows.count, 1)) * kept[:, None]
    return RowWeights.of(rows, weights[where], kept), weights


@examples(24)
@given(
    d=st.integers(1, 3),
    arrangement=st.sampled_from(ARRANGEMENTS),
    share=st.sampled_from([0.01, 0.3, 1.0]),
    seed=st.integers(0, 1000),
)
def test_forces_are_those_of_matrices(
    d: int, arrangement: Mapping[str, Any], share: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    (body,) = block(d, dict(arrangement)).build().model.bodies
    n = body.particles.count
    one = RowWeights.none(d)
    for _ in range(2):  # rows replace those that replaced others
        rows, weights = changed(body, rng.random(n) < share, rng)
        one = one.replaced_by(rows)
    pairs, weights = body.pairs(), _original(body)
    weights[np.isin(pairs.rows, one.particles)] = 0.0
    keys = pairs.rows * n + pairs.columns
    own = np.repeat(one.particles, one.sizes) * n + one.columns
    weights[np.searchsorted(keys, own)] = one.weights
    force = body.formulation.divergence.weights(pairs, weights, body.particles.volumes)
    expected = fixed_forces([body], [assembled(pairs, weights, force)], ())
    found = CompiledEngine().prepare([body], ()).reweighted([one])
    assert found is not None
    u = 1e-3 * rng.normal(size=(n, d))
    for name in ("forces", "gradients"):
        arguments = (0.0, u) if name == "forces" else (u,)
        a, b = (getattr(forces, name)(*arguments) for forces in (found, expected))
        assert np.abs(a - b).max() <= ROUNDING * np.abs(b).max()
    if len(one.particles):
        H = one.gradients(u)
        assert np.abs(H - expected.gradients(u)[one.particles]).max() <= ROUNDING * np.abs(H).max()


def _original(body: Body) -> Array:
    return changed(body, np.zeros(body.particles.count, dtype=np.bool_), np.random.default_rng())[1]


def test_engines_that_cannot_change_their_sums_say_so() -> None:
    (body,) = block(2).build().model.bodies
    assert MatrixEngine().prepare([body], ()).reweighted([RowWeights.none(2)]) is None
