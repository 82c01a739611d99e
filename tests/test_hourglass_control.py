"""Hourglass control: blind to linear motions, the derivative of an energy, and of use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from solidsph import BuildError, Record, Simulation
from solidsph.arrays import Array
from solidsph.builder import Builder
from solidsph.interfaces.condition import ForceCondition
from tests.scenes import box

JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 4}


def block(d: int, gradient: str = "corrected") -> Builder:
    return (
        box(d, {1: 12, 2: 6, 3: 5}[d], discretisation=JITTERED)
        .kernel("modified-mollifier", cover=3.5)
        .formulation("total-lagrangian", gradient=gradient)
        .effect("hourglass-control", strength=0.1)
    )


def penalty_of(simulation: Simulation) -> ForceCondition:
    (load,) = simulation.dynamics.loads
    return load


def random_motion(simulation: Simulation) -> Array:
    X = simulation.particles.positions
    return X + 0.01 * np.random.default_rng(1).standard_normal(X.shape)


@pytest.mark.parametrize("gradient", ["corrected", "quadratic"])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_linear_motions_are_free(d: int, gradient: str) -> None:
    simulation = block(d, gradient).build()
    X = simulation.particles.positions
    F = np.eye(d) + 0.3 * np.random.default_rng(d).standard_normal((d, d))
    penalty = penalty_of(simulation)
    forces = penalty.forces(0.0, X @ F.T + 0.7, np.zeros_like(X))
    scale = np.abs(penalty.forces(0.0, random_motion(simulation), np.zeros_like(X))).max()
    # The displacements are a hundred times those of the scale; rounding is left.
    assert np.abs(forces).max() < 1e-9 * scale


@pytest.mark.parametrize("d", [1, 2, 3])
def test_force_is_the_derivative_of_the_energy_and_keeps_momentum(d: int) -> None:
    simulation = block(d).build()
    penalty, x = penalty_of(simulation), random_motion(simulation)
    forces = penalty.forces(0.0, x, np.zeros_like(x))
    scale = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * scale
    moments = x[:, :, None] * forces[:, None, :]
    assert np.abs((moments - moments.transpose(0, 2, 1)).sum(axis=0)).max() < 1e-12 * scale
    step = np.random.default_rng(2).standard_normal(x.shape)
    # A quadratic energy: the central difference is exact but for rounding.
    change = penalty.energy(x + 1e-3 * step) - penalty.energy(x - 1e-3 * step)  # type: ignore[attr-defined]
    assert change / 2e-3 == pytest.approx(-float(np.vdot(forces, step)), rel=1e-8)


def test_the_ledger_closes_and_shows_the_share(tmp_path: Path) -> None:
    def residual(factor: float) -> float:
        simulation = (
            box(2, 8)
            .boundary("clamp", where="left")
            .effect("hourglass-control")
            .initial(velocity={"y": "2*X"})
            .integrator("velocity-verlet", time_step_factor=factor)
            .duration(0.03)
            .build()
        )
        path = tmp_path / f"{factor}.h5"
        simulation.run(record=path)
        with Record(path) as record:
            history = record.history
            own, work = (
                history["hourglass-control energy [J]"],
                history["work of hourglass-control [J]"],
            )
            # What the effect has taken from the motion is what it stores.
            assert own[-1] == pytest.approx(-work[-1], rel=0.05)
            assert 0.0 < history["hourglass-control share [-]"][-1] < 0.05
            return float(np.abs(history["energy residual [J]"]).max())

    assert residual(0.4) / residual(0.2) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_checkerboard_is_no_longer_free(d: int) -> None:
    """The motion that alternates from particle to particle, away from surfaces."""

    def frequency(builder: Builder) -> float:
        simulation = builder.build()
        X = simulation.particles.positions
        spacing = simulation.particles.spacings[0]
        signs = np.where(np.rint(X / spacing - 0.5).sum(axis=1) % 2, -1.0, 1.0)
        u = 1e-6 * spacing * signs[:, None] * np.ones(d)
        response = simulation.dynamics.respond(0.0, X + u, np.zeros_like(X))
        material = simulation.setting.bodies[0].material
        speed = np.sqrt(material.lame_parameters[1] / material.density)
        # Two supports inside, no sum reaches a particle whose own sums reach the surface.
        inside = np.minimum(X, 1.0 - X).min(axis=1) > 6.0 * spacing
        assert inside.any()
        u, a = u[inside], response.accelerations[inside]
        quotient = -np.vdot(u, a) / np.vdot(u, u)
        return float(np.sqrt(max(quotient, 0.0)) * spacing / speed)

    cells = {1: 24, 2: 16, 3: 13}[d]
    free = box(d, cells).kernel("modified-mollifier", cover=3.0)
    # In units of shear speed over spacing. The true wave of two spacings has pi; a soft penalty
    # gives motions that the gradient does not see about the root of its strength, here 0.32.
    before = frequency(free)
    after = frequency(free.effect("hourglass-control", strength=0.1))
    assert before < 1e-4
    assert 0.25 < after < 1.0


def test_it_needs_the_reference_configuration() -> None:
    builder = box(2).formulation("updated-lagrangian").effect("hourglass-control")
    with pytest.raises(BuildError, match="use 'total-lagrangian'"):
        builder.build()


def test_it_shortens_the_step_as_it_stiffens() -> None:
    soft, stiff = (
        box(2).effect("hourglass-control", strength=s).build().step_size for s in (0.1, 30.0)
    )
    assert stiff < 0.8 * soft
