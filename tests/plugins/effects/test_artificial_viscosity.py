"""Artificial viscosity: the pressure that it says, momentum kept, energy only ever taken."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import BuildError, Simulation
from solidsph.interfaces.terms import Load
from solidsph.maths.arrays import Array
from tests.helpers.scenes import SOFT, box

JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 4}


def viscous(d: int, cells: int, **strengths: float) -> tuple[Simulation, Load]:
    simulation = box(d, cells).effect("artificial-viscosity", **strengths).build()
    (load,) = simulation.dynamics.loads
    return simulation, load


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize(("linear", "quadratic"), [(1.0, 0.0), (0.0, 2.0), (0.5, 1.5)])
def test_a_uniform_compression_meets_the_pressure_it_says(
    d: int, linear: float, quadratic: float
) -> None:
    cells = {1: 40, 2: 16, 3: 12}[d]
    simulation, load = viscous(d, cells, linear=linear, quadratic=quadratic)
    X = simulation.particles.positions
    rate = 30.0  # [1/s], towards the middle
    v = -rate * (X - 0.5)
    forces = load.forces(0.0, X, v)
    # Power of the pairs by particle: half of each pair's, from the forces of one particle alone.
    spacing, c = 1.0 / cells, simulation.model.bodies[0].material.wave_speed
    pressure = (
        0.5 * SOFT["density"] * (linear * c * spacing * rate + quadratic * (spacing * rate) ** 2)
    )
    taken = -float(np.vdot(forces, v))
    # Supports are incomplete within a support's radius of the surface: there it is less.
    inner = (1.0 - 2.0 * 3.0 * spacing) ** d
    assert inner < taken / (d * pressure * rate) < 1.0
    p = int(np.argmin(np.linalg.norm(X - 0.5, axis=1)))
    pairs = load.pairs  # type: ignore[attr-defined]
    own = slice(pairs.starts[p], pairs.starts[p + 1])
    q = pairs.columns[own]
    pulls = load.pull((X[q] - X[p]).T, (v[q] - v[p]).T, pairs.values[own].T)  # type: ignore[attr-defined]
    virial = -0.5 * float(pulls @ np.sum((X[q] - X[p]) ** 2, axis=1))
    V = simulation.particles.volumes[p]
    smoothing = simulation.model.bodies[0].smoothing
    R = np.linalg.norm(X[q] - X[p], axis=1)
    sum_of_slopes = float(V * R @ np.abs(smoothing.slope(R)))  # the integral of it is d
    assert sum_of_slopes == pytest.approx(d, rel=0.01)  # a lattice's sum, three spacings wide
    # The softening, 1e-4 of squares, takes up to 2.5e-4 of the quadratic part.
    assert virial / V == pytest.approx(sum_of_slopes * pressure, rel=3e-4)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_momentum_is_kept_and_energy_taken(d: int) -> None:
    simulation = (
        box(d, {1: 12, 2: 6, 3: 5}[d], discretisation=JITTERED)
        .effect("artificial-viscosity")
        .build()
    )
    (load,) = simulation.dynamics.loads
    random = np.random.default_rng(1)
    X = simulation.particles.positions
    x, v = X + 0.02 * random.standard_normal(X.shape), random.standard_normal(X.shape)
    forces = load.forces(0.0, x, v)
    scale = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-14 * scale
    moments = x[:, :, None] * forces[:, None, :]
    assert np.abs((moments - moments.transpose(0, 2, 1)).sum(axis=0)).max() < 1e-14 * scale
    assert np.vdot(forces, v) < 0.0


def test_what_moves_apart_or_as_one_is_left_alone() -> None:
    _, load = viscous(2, 8)
    simulation, _ = viscous(2, 8)
    X: Array = simulation.particles.positions
    turning = np.column_stack([-(X[:, 1] - 0.5), X[:, 0] - 0.5])
    scale = np.abs(load.forces(0.0, X, -(X - 0.5))).max()
    assert not load.forces(0.0, X, 3.0 * (X - 0.5)).any()
    assert np.abs(load.forces(0.0, X, turning + 7.0)).max() < 1e-12 * scale


def test_the_declared_rate_bounds_the_true_one() -> None:
    """Of the linear part, with every pair approaching: the largest eigenvalue of its matrix."""
    simulation, load = viscous(2, 8, linear=1.0, quadratic=0.0)
    X, n = simulation.particles.positions, simulation.particles.count
    pairs = load.pairs  # type: ignore[attr-defined]
    p, q = pairs.rows, pairs.columns
    offsets = X[q] - X[p]
    r = np.linalg.norm(offsets, axis=1)
    damping = np.zeros((2 * n, 2 * n))
    for a, b, x, k in zip(p, q, offsets, pairs.values[:, 0] / r**3, strict=True):
        block = k * np.outer(x, x)
        damping[2 * a : 2 * a + 2, 2 * a : 2 * a + 2] += block
        damping[2 * a : 2 * a + 2, 2 * b : 2 * b + 2] -= block
    masses = np.repeat(simulation.dynamics.masses, 2)
    true = np.linalg.eigvals(damping / masses[:, None]).real.max()
    declared = load.damping_rate
    assert true <= declared < 2.5 * true


def test_refusals() -> None:
    with pytest.raises(BuildError, match="linear must be finite and not negative, got -1"):
        box(1).effect("artificial-viscosity", linear=-1.0).build()
    with pytest.raises(BuildError, match="leave the effect out"):
        box(1).effect("artificial-viscosity", linear=0.0, quadratic=0.0).build()
    with pytest.raises(BuildError, match="use 'total-lagrangian'"):
        box(2).formulation("updated-lagrangian").effect("artificial-viscosity").build()
