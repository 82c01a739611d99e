"""Particles on a plane of symmetry: with ghosts beyond it, half a body is the whole one's half."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solidsph import SceneError, Simulation
from solidsph.advice import Advice, advise
from solidsph.errors import BuildError
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.simulation import Simulation as Built
from solidsph.statics.equilibrium import equilibrium

ACROSS, RADIUS = 20, 0.2
ON = {"type": "lattice", "on_boundary": True}
GHOSTS = {"ghosts": 4, "ghost_faces": ["left", "bottom"]}


def sheet(discretisation: Any, *, gradient: str = "corrected", whole: bool = False) -> SceneBuilder:
    """A sheet with a hole, pulled along x: a quarter, or the whole."""
    side, low = (2.0, -1.0) if whole else (1.0, 0.0)
    builder = (
        Simulation.builder()
        .scheme("corrected")
        .body(
            "sheet",
            shape={
                "type": "difference",
                "of": {"type": "box", "lengths": [side, side], "origin": [low, low]},
                "minus": {"type": "disc", "radius": RADIUS},
            },
            spacing=1.0 / ACROSS,
            discretisation=discretisation,
        )
    )
    builder.material("linear-elastic", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
    builder.formulation("total-lagrangian", gradient=gradient)
    builder.boundary("traction", where="right", traction={"x": 1e3})
    if whole:
        # The other end, and what holds the sheet without a reaction, by symmetry.
        builder.boundary("traction", where="left", traction={"x": -1e3})
        near = f"< {0.6 / ACROSS}"
        builder.boundary("clamp", where=f"(top or bottom) and abs(X) {near}", axes=["x"])
        builder.boundary("clamp", where=f"left and abs(Y) {near}", axes=["y"])
    return builder.statics().duration(1.0)


def plane(builder: SceneBuilder, axis: str) -> SceneBuilder:
    return builder.boundary("symmetry", axis=axis)


def quarter(discretisation: Any, **options: Any) -> SceneBuilder:
    return plane(plane(sheet(discretisation, **options), "x"), "y")


def peak(built: Built) -> float:
    """Largest principal stress [Pa]."""
    u = equilibrium(built).state.positions - built.particles.positions
    stresses = built.dynamics.internal.fields(u).stresses[~built.particles.ghosts]
    return float(np.linalg.eigvalsh(0.5 * (stresses + stresses.transpose(0, 2, 1))).max())


def warnings(built: Built) -> list[Advice]:
    return [one for one in advise(built) if one.name == "half-supports"]


def test_a_quarter_without_ghosts_is_wrong_and_warned_of_and_the_remedies_are_right() -> None:
    """Beside the whole sheet of the same particles."""
    reference = peak(sheet(ON, whole=True).build())
    bare = quarter(ON).build()
    assert peak(bare) > 1.25 * reference
    assert ["ghosts = 4" in one.remedy for one in warnings(bare)] == [True, True]
    mirrored = quarter({**ON, **GHOSTS}).build()
    # The mirror is exact, but the particle at the rim has a ghost for what is cut there.
    assert peak(mirrored) == pytest.approx(reference, rel=0.02)
    assert warnings(mirrored) == []
    # It takes the surface into account. Of 20 particles a side, the largest stress of a particle
    # differs from that in its own whole sheet by 6.7 %; at 40 both are within 2 % of the right one.
    whole = peak(sheet("fitted", gradient="consistent", whole=True).build())
    consistent = quarter("fitted", gradient="consistent").build()
    assert peak(consistent) == pytest.approx(whole, rel=0.07)
    assert warnings(consistent) == []


def test_of_cells_the_quarter_with_ghosts_is_the_whole() -> None:
    """No particle lies on a plane, and each ghost is the mirror image of a particle. The whole is
    held beside its axes, in the thousandth part of what it is stretched by."""
    reference = peak(sheet("lattice", whole=True).build())
    mirrored = quarter({"type": "lattice", **GHOSTS}).build()
    assert warnings(mirrored) == []
    assert peak(mirrored) == pytest.approx(reference, rel=1e-3)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_plane_is_named(axis: str) -> None:
    """Ghosts beyond one plane complete the supports there, and not at the other."""
    behind = {"x": "bottom", "y": "left"}[axis]
    built = quarter({**ON, "ghosts": 4, "ghost_faces": [behind]}).build()
    (heard,) = warnings(built)
    assert f"on the plane of symmetry {axis} = 0 m (" in heard.finding
    assert "ghosts = 4" in heard.remedy


def test_rollers_on_a_face_are_a_plane_of_symmetry_too() -> None:
    """Held along the normal alone: the same problem, and the same half of a support."""
    rollers = sheet(ON).boundary("clamp", where="left", axes=["x"])
    rollers.boundary("clamp", where="bottom", axes=["y"])
    built = rollers.build()
    assert len(warnings(built)) == 2
    assert peak(built) == pytest.approx(peak(quarter(ON).build()), rel=1e-6)


def test_a_plane_is_told_without_its_rounding() -> None:
    """The rows of a lattice that conforms come to rest at 1e-20 m, and that is no place."""
    for one in warnings(quarter("conforming-lattice").build()):
        assert " = 0 m (" in one.finding


def test_no_false_alarm() -> None:
    """Cell-centred rollers, a clamp along all axes, held particles inside, quadratic gradients."""
    cells = sheet("lattice").boundary("clamp", where="left", axes=["x"])
    clamped = sheet(ON).boundary("clamp", where="left")
    inside = sheet(ON).boundary("clamp", where="abs(X - 0.5) < 0.01", axes=["x"])
    for builder in (cells, clamped, inside, quarter(ON, gradient="quadratic")):
        assert warnings(builder.build()) == []


def test_the_message_of_the_build_names_what_is_right() -> None:
    with pytest.raises((BuildError, SceneError), match="ghosts behind that face") as told:
        quarter("lattice").build()
    assert "consistent" in str(told.value)
