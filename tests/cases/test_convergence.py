"""Order of convergence of displacements on a body with free surfaces, by a manufactured solution.

A smooth displacement of finite strain is made an equilibrium of a nonlinear law by the body force
-Div P and by the tractions P N on three free sides; the fourth is held on it. Body force and
tractions come from the law's own first Piola stress, differentiated numerically.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first
from solidsph.statics import equilibrium
from solidsph.testing import example_part
from tests.helpers.scenes import SOFT

MATERIAL = example_part("materials", "neo-hookean", **SOFT)
_STEP = 1e-3  # [m] of the differences: sixth order, so 1e-15 is left of waves of length 2


def displacement(X: Array) -> Array:
    """Strains up to 0.15; no symmetry, nothing vanishes on a side."""
    x, y = X.T
    return 0.05 * np.stack(
        [np.sin(2.0 * x + 0.5) * np.cos(1.5 * y), np.cos(1.7 * x) * np.sin(2.0 * y + 0.3)], axis=1
    )


def derivative(f: Callable[[Array], Array], X: Array, axis: int) -> Array:
    step = _STEP * np.eye(2)[axis]
    weights = {1: 45.0, 2: -9.0, 3: 1.0}
    change = sum(w * (f(X + k * step) - f(X - k * step)) for k, w in weights.items())
    return np.asarray(change / (60.0 * _STEP))


def stress(X: Array) -> Array:
    """First Piola stress of the solution at X (n, 2), (n, 2, 2) [Pa]."""
    F = np.eye(2) + np.stack([derivative(displacement, X, k) for k in range(2)], axis=2)
    return particles_first(MATERIAL.first_piola(components_first(F), MATERIAL.params), len(X))


def body_force(X: Array) -> Array:
    divergence = sum(derivative(lambda Y, k=k: stress(Y)[:, :, k], X, k) for k in range(2))
    return np.asarray(-divergence / MATERIAL.density)


def table(f: Callable[[Array], Array]) -> dict[str, Callable[[Array, float], Array]]:
    known: dict[bytes, Array] = {}

    def at(X: Array) -> Array:
        # The same points are asked for at every step of the load and of Newton's method.
        key = X.tobytes()
        if key not in known:
            known[key] = f(X)
        return known[key]

    return {name: lambda X, t, i=i: at(X)[:, i] for i, name in enumerate("xy")}


def error(cells: int, gradient: object) -> float:
    """Root mean square of the error over that of the solution."""
    builder = (
        Simulation.builder()
        .body(
            "square",
            shape={"type": "box", "lengths": [1.0, 1.0]},
            spacing=1.0 / cells,
            discretisation={"type": "lattice", "on_boundary": True},
        )
        .kernel("modified-mollifier", cover=3.0)
        .material(MATERIAL)
        .formulation("total-lagrangian", gradient=gradient)
        .boundary("prescribed-motion", where="left", displacement=table(displacement))
        .effect("body-force", acceleration=table(body_force))
        .duration(1.0)
    )
    for face, axis, sign in (("right", 0, 1.0), ("top", 1, 1.0), ("bottom", 1, -1.0)):
        traction = table(lambda X, axis=axis, sign=sign: sign * stress(X)[:, :, axis])
        builder = builder.boundary("traction", where=face, traction=traction)
    simulation = builder.build()
    X, V = simulation.particles.positions, simulation.particles.volumes
    exact = displacement(X)
    u = equilibrium(simulation).state.positions - X
    return float(np.sqrt(V @ ((u - exact) ** 2).sum(axis=1) / (V @ (exact**2).sum(axis=1))))


def order(cells: list[int], errors: list[float]) -> float:
    return -float(np.polyfit(np.log(cells), np.log(errors), 1)[0])


def test_displacements_converge_in_the_second_order() -> None:
    cells = [6, 9, 12, 18]
    errors = [error(n, "consistent") for n in cells]
    print("manufactured solution, error by cells:", dict(zip(cells, errors, strict=True)))
    assert errors[0] < 0.06
    assert np.all(np.diff(errors) < 0.0)
    # Quadratic gradients: 2 in theory.
    assert order(cells, errors) > 1.8


def test_without_consistency_the_order_is_one() -> None:
    """Exact gradients are not enough: what a constant stress does beside a surface must be nil."""
    cells = [8, 12]
    for gradient in ("corrected", "quadratic"):
        assert order(cells, [error(n, gradient) for n in cells]) < 1.3


@pytest.mark.validation
@pytest.mark.parametrize("of", ["corrected", "cubic"])
def test_the_order_stays_on_finer_lattices(of: str) -> None:
    """With `quadratic`, whose sums cannot be mended beside the surface alone, it is 1.4."""
    cells = [16, 24, 32, 48]
    errors = [error(n, {"type": "consistent", "of": of}) for n in cells]
    print(f"manufactured solution, {of}, error by cells:", dict(zip(cells, errors, strict=True)))
    assert order(cells, errors) > 1.8
