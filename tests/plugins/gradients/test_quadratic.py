"""The quadratic gradient: exact for constant strain gradients, and honest where it cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array
from tests.helpers.scenes import SOFT


def block(lengths: list[float], spacing: float, gradient: str, jitter: float = 0.0) -> Body:
    discretisation = (
        {"type": "jittered-lattice", "amplitude": jitter, "seed": 3} if jitter else "lattice"
    )
    return (
        Simulation.builder()
        .body(
            "block",
            shape={"type": "box", "lengths": lengths},
            spacing=spacing,
            discretisation=discretisation,
        )
        .kernel("modified-mollifier", cover=3.5)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian", gradient=gradient)
        .duration(1.0)
        .build()
        .model.bodies[0]
    )


def gradients(body: Body, values: Array) -> Array:
    """Discrete gradient of `values` (n,) at every particle, (n, d)."""
    pairs = body.pairs()
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    weights = body.formulation.gradient.weights(pairs, kernel_gradients, body.particles.volumes)
    return pairs.row_sums(weights * values[pairs.columns, None])


@pytest.mark.parametrize(("lengths", "jitter"), [([1.0, 0.6], 0.2), ([0.8, 0.6, 0.6], 0.2)])
def test_quadratic_fields_are_exact_on_jittered_lattices(
    lengths: list[float], jitter: float
) -> None:
    body = block(lengths, 0.1, "quadratic", jitter)
    X = body.particles.positions
    values = 1.0 + X[:, 0] - 2.0 * X[:, 1] + X[:, 0] * X[:, 1] - 0.5 * X[:, 1] ** 2
    exact = np.zeros_like(X)
    exact[:, 0] = 1.0 + X[:, 1]
    exact[:, 1] = -2.0 + X[:, 0] - X[:, 1]
    # The patch test of the bar is 1e-8; rounding, amplified by condition numbers of 1e3, is less.
    assert np.abs(gradients(body, values) - exact).max() < 1e-11


def test_observed_order_at_free_surfaces() -> None:
    """Error of the gradient of a smooth field, everywhere, surfaces included."""

    def error(gradient: str, cells: int) -> float:
        body = block([1.0, 1.0], 1.0 / cells, gradient)
        X = body.particles.positions
        values = np.sin(2.0 * X[:, 0]) * np.exp(X[:, 1])
        exact = np.column_stack([2.0 * np.cos(2.0 * X[:, 0]) * np.exp(X[:, 1]), values])
        return float(np.abs(gradients(body, values) - exact).max())

    cells = np.array([8, 16, 32])
    for gradient, low, high in (("corrected", 0.8, 1.2), ("quadratic", 1.8, 2.3)):
        errors = [error(gradient, int(n)) for n in cells]
        order = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
        assert low < order < high, f"{gradient}: order {order:.2f}, errors {errors}"


def test_thin_bodies_fall_back_to_linear_and_say_so() -> None:
    with pytest.warns(UserWarning, match=r"too few or too flat neighbours .* use the linear one"):
        thin = gradients(block([1.0, 0.2], 0.1, "quadratic"), np.arange(20.0))
    linear = gradients(block([1.0, 0.2], 0.1, "corrected"), np.arange(20.0))
    assert np.array_equal(thin, linear)


def test_quadratic_equals_itself_row_by_row() -> None:
    """Rows may be found in portions: an engine never needs all pairs at once."""
    import attrs

    body = block([0.6, 0.6, 0.6], 0.1, "quadratic")
    pairs = body.pairs()
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    gradient, volumes = body.formulation.gradient, body.particles.volumes
    whole = gradient.weights(pairs, kernel_gradients, volumes)
    middle = slice(pairs.starts[70], pairs.starts[90])
    portion = attrs.evolve(
        pairs,
        starts=pairs.starts[70:91] - pairs.starts[70],
        rows=pairs.rows[middle],
        columns=pairs.columns[middle],
        offsets=pairs.offsets[middle],
        distances=pairs.distances[middle],
    )
    found = gradient.weights(portion, kernel_gradients[middle], volumes)
    assert np.array_equal(found, whole[middle])
