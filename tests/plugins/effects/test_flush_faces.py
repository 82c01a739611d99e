"""Bodies whose faces lie on each other do not press, however they are divided into particles."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Record, Simulation
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT
from tests.plugins.effects.test_contact import MODULUS, forces

RATIOS = (1.0, 1.25, 1.6, pi / 2.0, 2.0, 3.0, 4.0)
JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 3}
STEEL = {
    "youngs_modulus": 210e9,
    "poissons_ratio": 0.3,
    "density": 7850.0,
    "yield_stress": 0.4e9,
    "hardening": 1e9,
}

# What the task of contact is: a thousandth of the modulus is below the yield stress of any metal.
PRESSED = 1e-3


def pair(
    d: int,
    spacings: tuple[float, float],
    sides: tuple[float, float] = (1.0, 1.0),
    gap: float = 0.0,
    aside: float = 0.0,
    discretisations: tuple[Any, Any] = ("lattice", "lattice"),
) -> SceneBuilder:
    """Two boxes, the second to the right of the first by `gap`, and moved aside [m]."""
    builder = (
        Simulation.builder()
        .kernel("cubic-spline", cover=2.2)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian")
        .engine("matrix")
        .duration(1e-2)
    )
    for k, name in enumerate(("block", "other")):
        start = [0.0] * d if k == 0 else [sides[0] + gap, *[aside] * (d - 1)]
        shape: Mapping[str, Any] = {"type": "box", "lengths": [sides[k]] * d, "origin": start}
        if d == 1:
            shape = {"type": "interval", "length": sides[k], "origin": start[0]}
        builder.body(name, shape=shape, spacing=spacings[k], discretisation=discretisations[k])
    return builder.effect("contact")


def pressed(simulation: Simulation, x: Array) -> float:
    """Largest force on a particle over the face of its cell and the modulus [-]."""
    V = simulation.particles.volumes
    size = np.linalg.norm(forces(simulation, x), axis=1)
    return float(np.max(size / V ** (1.0 - 1.0 / x.shape[1]))) / MODULUS


def put(simulation: Simulation, way: float, aside: float = 0.0) -> Array:
    """Positions with the second body moved by -`way` along x, and aside, (n, d) [m]."""
    x = simulation.particles.positions.copy()
    rows = simulation.particles.bodies["other"]
    x[rows, 0] -= way
    x[rows, 1:] += aside
    return x


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("finer", [0, 1])
def test_flush_faces_of_any_spacings_are_free_of_force(ratio: float, finer: int) -> None:
    """By definition where bodies begin so, and by the rows of the other body where they come so."""
    coarse, sides = 0.125, (0.5, 0.5)
    spacings = (coarse / ratio, coarse) if finer == 0 else (coarse, coarse / ratio)
    at_rest = pair(2, spacings, sides, aside=0.07).build()
    # Rounding alone, and of that the tolerance takes care.
    assert pressed(at_rest, at_rest.particles.positions) == 0.0
    came = pair(2, spacings, sides, gap=1.0).build()
    # Aligned edges, lattices out of registry, an edge with less than half of the face beside it.
    for aside in (0.0, 0.07, 0.31):
        assert pressed(came, put(came, 1.0, aside)) < 0.3 * PRESSED
        # They do touch: a push by a twentieth of a spacing is felt.
        assert pressed(came, put(came, 1.0 + 0.05 * coarse, aside)) > 20.0 * PRESSED


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("d", [1, 3])
def test_flush_faces_on_a_line_and_in_space(d: int, ratio: float) -> None:
    coarse = 0.25
    came = pair(d, (coarse, coarse / ratio), (0.75, 0.75), gap=1.0).build()
    for aside in (0.0, 0.17):
        assert pressed(came, put(came, 1.0, aside)) < 0.5 * PRESSED


@pytest.mark.parametrize(
    "changed",
    [
        {"sides": (0.5, 1.0), "aside": -0.27},  # a small block on a large one
        {"sides": (1.0, 0.5), "aside": 0.8},  # overhanging
        {"spacings": (0.13, 0.071)},  # that do not divide the sides
        {"discretisations": ({"type": "lattice", "on_boundary": True},) * 2},
        {"discretisations": ({"type": "lattice", "on_boundary": True}, "lattice")},
        {"discretisations": ("conforming-lattice", "lattice")},
    ],
)
def test_edges_and_other_lattices(changed: Mapping[str, Any]) -> None:
    given = {"spacings": (1 / 8, 1 / 12), **changed}
    came = pair(2, gap=1.0, **given).build()
    assert pressed(came, put(came, 1.0)) < PRESSED
    at_rest = pair(2, **given).build()
    assert pressed(at_rest, at_rest.particles.positions) == 0.0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_scattered_particles(d: int) -> None:
    """Without a force at the start; one that comes later touches by a tenth of a spacing early or
    late, as sums beside scattered particles differ: on a line, where a face is one particle, by as
    much as that one has been moved."""
    given: dict[str, Any] = {"discretisations": (JITTERED, {**JITTERED, "seed": 4})}
    at_rest = pair(d, (0.2, 0.15), **given).build()
    assert pressed(at_rest, at_rest.particles.positions) == 0.0
    came = pair(d, (0.2, 0.15), gap=1.0, **given).build()
    rows, off = came.particles.bodies["block"], 0.2 if d == 1 else 0.1
    apart, close = (
        -float(forces(came, put(came, 1.0 + way * 0.2))[rows, 0].sum()) for way in (-off, off)
    )
    assert apart < 5e-3 * MODULUS < close


def corner(gap: float) -> SceneBuilder:
    """A block in the inner corner of an angle, where the angle is on two sides of it."""
    angle = {
        "type": "difference",
        "of": {"type": "box", "lengths": [1.0, 1.0]},
        "minus": {"type": "box", "lengths": [0.6, 0.6], "origin": [0.4, 0.4]},
    }
    inner = {"type": "box", "lengths": [0.4, 0.4], "origin": [0.4 + gap, 0.4]}
    builder = pair(2, (0.1, 0.1)).scene()
    return Simulation.builder(
        attrs.evolve(
            builder,
            bodies={
                "block": attrs.evolve(builder.bodies["block"], shape=angle),
                "other": attrs.evolve(builder.bodies["other"], shape=inner, spacing=0.05),
            },
        )
    )


def test_a_block_in_a_corner() -> None:
    """Two faces fill more than one: the reference configuration says how much is free of force."""
    simulation = corner(0.0).build()
    assert pressed(simulation, simulation.particles.positions) == 0.0
    assert pressed(simulation, put(simulation, 0.005)) > 20.0 * PRESSED


@pytest.mark.parametrize("spacing", [0.02, 0.016, 0.01])
def test_steel_at_rest_stays_at_rest(spacing: float, tmp_path: Path) -> None:
    """Blocks of unlike spacing, of a material that yields: nothing acts, so nothing happens."""
    simulation = (
        pair(2, (0.02, spacing), (0.12, 0.12))
        .material("j2-plasticity", **STEEL)
        .duration(2e-5)
        .build()
    )
    simulation.run(record=tmp_path / "run.h5")
    with Record(tmp_path / "run.h5") as record:
        assert record.field("plastic strain")[-1].max() == 0.0
        assert record.history["contact touching pairs [-]"].max() == 0.0
        # A thousandth of the modulus moves a particle with some 5 m/s; rounding of positions by
        # 1e-17 m is a force that moves none.
        assert np.abs(record.field("velocity")[-1]).max() < 1e-9


@pytest.mark.parametrize("spacings", [(0.05, 0.02), (0.02, 0.05), (0.05, 0.03125)])
def test_a_block_rests_at_its_height(spacings: tuple[float, float]) -> None:
    """The plate is held and the block is rigid: where its weight is carried, it is a hundredth of
    a spacing below the plate's face, as the contact yields by one spacing of material."""
    simulation = pair(2, spacings, (0.2, 0.4), aside=-0.1, gap=0.5).build()
    rows = simulation.particles.bodies["block"]
    weight = 0.01 * MODULUS * 0.2
    low, high, coarse = -0.3, 0.3, max(spacings)
    for _ in range(40):
        middle = 0.5 * (low + high)
        held = -float(forces(simulation, put(simulation, 0.5 + middle * coarse))[rows, 0].sum())
        low, high = (low, middle) if held > weight else (middle, high)
    # Beside edges the yield of a small block is up to twice that of a wide face.
    assert 0.0 < low < 0.02
