"""Neighbours that see each other: none across a gap, all along a surface and across a seam.

Which lines leave a body is told here by other means than the signed distance that the code follows:
by crossings of segments, and by reasoning on a lattice.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Simulation
from solidsph.assembly.visibility import hidden_pairs
from solidsph.engines.compiled.fixed.chunks import weighted_chunks
from solidsph.engines.compiled.moving.search import NeighbourSearch
from solidsph.interfaces.body import Body, part_of
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Hidden, neighbour_pairs
from solidsph.model.particles import Particles
from solidsph.registry.construct import construct
from solidsph.run.energy import KINETIC
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT

H = 0.1  # spacing
ON_BOUNDARY = {"type": "lattice", "on_boundary": True}
ARRANGEMENTS = ["lattice", ON_BOUNDARY, "conforming-lattice"]
COMPILES = pytest.mark.validation  # a minute of compiling
JITTERED = {"type": "jittered-lattice", "amplitude": 0.25, "seed": 3}


def box(lengths: list[float], origin: list[float] | None = None) -> dict[str, Any]:
    return {"type": "box", "lengths": lengths, "origin": origin or [0.0] * len(lengths)}


def cut(of: dict[str, Any], *minus: dict[str, Any]) -> dict[str, Any]:
    return {"type": "difference", "of": of, "minus": list(minus)}


def union(*of: dict[str, Any]) -> dict[str, Any]:
    return {"type": "union", "of": list(of)}


def found(
    shape: dict[str, Any], discretisation: Any = "lattice", cover: float = 3.5, spacing: float = H
) -> tuple[Particles, Indices, Indices, Mask]:
    """Particles, the ends of all near pairs, and which of these are hidden."""
    made = construct("shapes", shape)
    particles = construct("discretisations", discretisation).particles(made, spacing)
    near = neighbour_pairs(particles.positions, cover * spacing)
    hidden = hidden_pairs(made, particles, cover * spacing)
    none = np.zeros(near.count, dtype=np.bool_)
    told = none if hidden is None else hidden.between(near.rows, near.columns)
    return particles, near.rows, near.columns, told


def crossing(X: Array, rows: Indices, columns: Indices, start: Array, end: Array) -> Mask:
    """Whether the lines between particles cross the segment from `start` to `end`, in the plane."""

    def side(a: Array, b: Array, c: Array) -> Array:
        left, right = b - a, c - a
        return np.sign(left[..., 0] * right[..., 1] - left[..., 1] * right[..., 0])

    p, q = X[rows], X[columns]
    apart = side(p, q, start) * side(p, q, end) < 0
    return np.asarray(apart & (side(start, end, p) * side(start, end, q) < 0))


# One dimension, and pieces.


@pytest.mark.parametrize(
    ("engine", "gap"),
    [
        *(("matrix", gap) for gap in (0.05, 0.5, 1.0, 2.4)),
        pytest.param("compiled", 1.0, marks=COMPILES),
    ],
)
@pytest.mark.parametrize("form", ["total-lagrangian", "updated-lagrangian"])
def test_pieces_of_a_body_do_not_act_on_each_other(gap: float, engine: str, form: str) -> None:
    """A piece that is moved as a whole is not strained, so no force acts on it: 0 but for rounding.

    Moved away it is at a distance; moved closer by a whole gap it would be taken for a neighbour
    that was none at the start, which is for contact to prevent.
    """
    second = {"type": "interval", "length": 1.0, "origin": 1.0 + gap * H}
    shape = union({"type": "interval", "length": 1.0}, second)
    built = (
        Simulation.builder()
        .scheme("corrected")
        .body("both", shape=shape, spacing=H)
        .kernel("modified-mollifier")
        .material("neo-hookean", **SOFT)
        .formulation(form)
        .engine(engine)
        .duration(1e-3)
        .build()
    )
    X = built.particles.positions
    free = X[:, 0] > 1.0 + 0.5 * gap * H
    for move in (0.1 * H, -0.9 * gap * H):
        u = np.where(free[:, None], move, 0.0)
        forces = built.dynamics.internal.forces(0.0, u)
        # Strains of rounding, 1e-15, times the modulus.
        assert np.abs(forces).max() < 1e-12 * SOFT["youngs_modulus"]


def thrown(two_bodies: bool) -> SceneBuilder:
    """A small block that flies off a larger one, a spacing away."""
    big, small = box([0.6, 0.4]), box([0.3, 0.4], [0.7, 0.0])
    scene = Simulation.builder().scheme("corrected")  # cells: of no volume off the blocks
    scene.material("neo-hookean", **SOFT).engine("matrix").duration(2e-3)
    if two_bodies:
        scene.body("one", shape=big, spacing=H).body("two", shape=small, spacing=H)
    else:
        scene.body("both", shape=union(big, small), spacing=H)
    return scene.initial(where="X > 0.65", velocity={"x": 5.0}).outputs(1)


def test_a_piece_that_is_thrown_away_keeps_its_kinetic_energy() -> None:
    """m v^2 / 2 = 1000 * 0.3 * 0.4 * 25 / 2 = 1500 J, as one body of two pieces or as two."""
    for two_bodies in (False, True):
        simulation = thrown(two_bodies).build()
        state = simulation.run().state
        kinetic = 0.5 * simulation.model.masses @ np.sum(state.velocities**2, axis=1)
        # A block at rest in itself is accelerated by rounding alone.
        assert kinetic == pytest.approx(1500.0, rel=1e-10), KINETIC


# Slots and notches.


@pytest.mark.parametrize("width", [0.05, 0.2, 0.5, 1.0, 2.4])
@pytest.mark.parametrize("middle", [0.5, 0.53, 0.45])
@pytest.mark.parametrize("arrangement", [*ARRANGEMENTS, JITTERED], ids=str)
def test_nobody_sees_across_a_slot(width: float, middle: float, arrangement: Any) -> None:
    """Whether the slot falls between two rows, beside a row or on one. A line that crosses the
    slot's centre line crosses the slot."""
    w, tip = width * H, 0.6
    shape = cut(box([1.0, 1.0]), box([tip + 0.2, w], [-0.2, middle - 0.5 * w]))
    particles, rows, columns, hidden = found(shape, arrangement)
    X = particles.positions
    centre = np.array([[-1.0, middle], [tip, middle]])
    # Particles nearer to the slot than half a spacing are looked at from that deep: of lines that
    # pass the tip more closely some may be hidden or not.
    clear = crossing(X, rows, columns, centre[0], centre[1] - [H, 0.0])
    assert clear.any() or width > 2.0  # on a row, a wide slot leaves four spacings
    assert hidden[clear].all()
    wide = [[-1.0, middle], [tip + 1.5 * H, middle]]
    near_slot = crossing(X, rows, columns, *np.array(wide))
    beside = np.abs(X[:, 1] - middle) < 0.5 * w + 1e-9
    assert not hidden[~near_slot & ~beside[rows] & ~beside[columns]].any()


@pytest.mark.parametrize("angle", [0.3, 1.0, 1.2])
def test_nobody_sees_across_an_oblique_crack(angle: float) -> None:
    """A wedge in a polygon, a spacing wide at its mouth, at any angle to the rows. From a spacing
    behind its tip on it is wider than a tenth of one."""
    tip = np.array([0.5, 0.5])
    way = np.array([-np.cos(angle), -np.sin(angle)])
    aside = 0.5 * H * np.array([-way[1], way[0]])
    reach = 0.5 / max(abs(way))
    mouth = tip + reach * way
    corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    wedge = [(mouth - aside).tolist(), tip.tolist(), (mouth + aside).tolist()]
    if abs(way[0]) > abs(way[1]):  # it opens to the left
        wedge = [[0.0, one[1]] if k != 1 else one for k, one in enumerate(wedge)]
        vertices = [*corners[:4], *sorted((wedge[0], wedge[2]), key=lambda p: -p[1])]
        vertices.insert(5, wedge[1])
    else:  # to the bottom
        wedge = [[one[0], 0.0] if k != 1 else one for k, one in enumerate(wedge)]
        first, last = sorted((wedge[0], wedge[2]), key=lambda p: p[0])
        vertices = [corners[0], first, wedge[1], last, *corners[1:]]
    particles, rows, columns, hidden = found({"type": "polygon", "vertices": vertices})
    X = particles.positions
    clear = crossing(X, rows, columns, mouth + 0.5 * way, tip + 1.0 * H * way)
    assert clear.any()
    assert hidden[clear].all()


def test_arms_of_a_tuning_fork_and_the_mouth_of_a_clip() -> None:
    """Two arms, 1.5 spacings apart; a ring with a mouth of one spacing."""
    fork = [[0, 0], [0.2, 0], [0.2, 0.8], [0.35, 0.8], [0.35, 0], [0.55, 0], [0.55, 1], [0, 1]]
    particles, rows, columns, hidden = found({"type": "polygon", "vertices": fork}, cover=4.0)
    x, y = particles.positions.T
    arms = (x[rows] < 0.25) & (x[columns] > 0.3) & (np.maximum(y[rows], y[columns]) < 0.8)
    assert arms.any()
    assert hidden[arms].all()
    ring = {"type": "annulus", "inner_radius": 0.4, "outer_radius": 0.8}
    clip = cut(ring, box([1.0, H], [0.0, -0.5 * H]))
    particles, rows, columns, hidden = found(clip)
    x, y = particles.positions.T
    lips = (y[rows] > 0.0) & (y[columns] < 0.0) & (x[rows] > 0.5) & (x[columns] > 0.5)
    assert lips.any()
    assert hidden[lips].all()
    assert not hidden[(x[rows] < 0.0) & (x[columns] < 0.0)].any()


def test_a_hole_smaller_than_the_support_hides_what_lies_behind_it() -> None:
    """A round hole of one spacing's radius about a corner of the cells: of two particles opposite
    each other, two spacings apart on each side, the line passes the middle."""
    hole = {"type": "disc", "radius": H, "centre": [0.5, 0.5]}
    particles, rows, columns, hidden = found(cut(box([1.0, 1.0]), hole))
    away = np.linalg.norm(
        0.5 * (particles.positions[rows] + particles.positions[columns]) - 0.5, axis=1
    )
    through = (away < 1e-9) & (rows != columns)
    assert through.any()
    assert hidden[through].all()


def test_a_reentrant_corner_hides_what_its_corner_covers() -> None:
    """Five pairs of a lattice at a cover of 3.5, counted by hand.

    Particles at (i + 1/2, -j - 1/2) and (-k - 1/2, l + 1/2) spacings from the corner see each
    other unless (2i + 1)(2l + 1) > (2j + 1)(2k + 1); within 3.5 spacings that leaves j = k = 0 and
    (i, l) = (1, 0), (0, 1), (1, 1), (2, 0), (0, 2). A line through the corner itself is free.
    """
    for shape in (
        union(box([1.0, 0.5]), box([0.5, 1.0])),
        {
            "type": "polygon",
            "vertices": [[0, 0], [1, 0], [1, 0.5], [0.5, 0.5], [0.5, 1], [0, 1]],
        },
    ):
        assert found(shape)[3].sum() == 2 * 5


def test_a_gap_in_space() -> None:
    """Two plates, half a spacing apart, on a common foot: nothing acts from plate to plate above
    it."""
    plates = cut(box([0.85, 0.4, 0.8]), box([0.05, 1.0, 1.0], [0.4, -0.2, 0.3]))
    particles, rows, columns, hidden = found(plates, cover=2.6)
    x, _, z = particles.positions.T
    across = (x[rows] < 0.4) & (x[columns] > 0.45) & (z[rows] > 0.3) & (z[columns] > 0.3)
    assert across.any()
    assert hidden[across].all()
    assert not hidden[(z[rows] < 0.3) & (z[columns] < 0.3)].any()


# What must stay connected.

TURNED = [[0.0, 0.0], [0.8, 0.6], [0.5, 1.0], [-0.3, 0.4]]  # a box by a 3-4-5 triangle
BESIDE = [[0.8, 0.6], [1.6, 1.2], [1.3, 1.6], [0.5, 1.0]]
WHOLE = {
    "box": box([1.0, 0.7]),
    "disc": {"type": "disc", "radius": 0.5},
    "turned": {"type": "polygon", "vertices": TURNED},
    "cylinder": {"type": "cylinder", "radius": 0.3, "length": 0.5},
    "seam": union(box([0.5, 1.0]), box([0.5, 1.0], [0.5, 0.0])),
    "seam off the rows": union(box([0.43, 1.0]), box([0.57, 1.0], [0.43, 0.0])),
    "seam of rounding": union(box([0.3, 1.0]), box([0.7, 1.0], [0.1 + 0.2, 0.0])),
    "seam turned": union(
        {"type": "polygon", "vertices": TURNED}, {"type": "polygon", "vertices": BESIDE}
    ),
    "seam in a line": union(
        {"type": "interval", "length": 0.5}, {"type": "interval", "length": 0.7, "origin": 0.5}
    ),
    "overlap": union(box([0.6, 1.0]), box([0.6, 1.0], [0.4, 0.0])),
    "seam in space": union(box([0.5, 0.5, 0.3]), box([0.5, 0.5, 0.3], [0.0, 0.0, 0.3])),
}


@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize("arrangement", ["lattice", ON_BOUNDARY], ids=str)
def test_nothing_is_hidden_in_a_convex_body_or_across_a_seam(name: str, arrangement: Any) -> None:
    assert not found(WHOLE[name], arrangement)[3].any()


@pytest.mark.parametrize("arrangement", [*ARRANGEMENTS, JITTERED], ids=str)
@pytest.mark.parametrize("corners", [None, 24, 90])
def test_nothing_is_hidden_along_a_smooth_hole(arrangement: Any, corners: int | None) -> None:
    """A round hole, or a polygon in its place, of four spacings' radius: from half a spacing deep,
    lines of 2 sqrt(4.5^2 - 4^2) = 4.1 spacings are free, and 3.5 is the longest."""
    r, centre = 4.0 * H, [0.9, 0.9]
    hole: dict[str, Any] = {"type": "disc", "radius": r, "centre": centre}
    if corners is not None:
        angles = 2.0 * np.pi * np.arange(corners) / corners
        vertices = 0.9 + r * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        hole = {"type": "polygon", "vertices": vertices.tolist()}
    # Moved inwards, a particle of a conforming or jittered arrangement has longer lines: cover 3.
    cover = 3.5 if arrangement in ("lattice", ON_BOUNDARY) else 3.0
    assert not found(cut(box([1.8, 1.8]), hole), arrangement, cover)[3].any()


def test_nothing_is_hidden_in_a_mapped_ring() -> None:
    """Particles on the circles themselves, whose chords cut the hole by up to 0.3 spacings."""
    to = {"x": "-(0.4 + Y)*cos(X/0.6)", "y": "(0.4 + Y)*sin(X/0.6)"}
    ring = cut(
        {"type": "annulus", "inner_radius": 0.4, "outer_radius": 0.8},
        box([2.0, 1.0], [-1.0, -1.0]),
    )
    mapped = {"type": "mapped", "of": ON_BOUNDARY, "before": box([0.6 * np.pi, 0.4]), "to": to}
    assert not found(ring, mapped, cover=2.6)[3].any()


def test_ghosts_see_everyone() -> None:
    """They lie outside on purpose: beyond a plane, and in a slot."""
    shape = cut(box([1.0, 1.0]), box([0.6, 0.5 * H], [0.0, 0.5 - 0.25 * H]))
    particles, rows, columns, hidden = found(shape, {"type": "lattice", "ghosts": 3})
    ghosts = particles.ghosts[rows] | particles.ghosts[columns]
    assert not hidden[ghosts].any()
    assert hidden.any()


# One decision for everyone who asks.


def notched(**options: Any) -> SceneBuilder:
    shape = cut(box([1.0, 0.8]), box([0.5, 0.2 * H], [0.0, 0.4 - 0.1 * H]))
    builder = Simulation.builder().body("plate", shape=shape, spacing=H)
    builder.kernel("modified-mollifier").material("neo-hookean", **SOFT).duration(1e-3)
    return builder.formulation("total-lagrangian", **options)


def plate(builder: SceneBuilder) -> Body:
    (body,) = builder.engine("matrix").build().model.bodies
    return body


@pytest.mark.parametrize(
    ("gradient", "divergence"),
    [
        ("corrected", "variational"),
        ("consistent", "variational"),
        pytest.param("corrected", "plain", marks=COMPILES),
    ],
)
def test_both_engines_have_the_same_neighbours(gradient: str, divergence: str) -> None:
    builder = notched(gradient=gradient, divergence=divergence)
    forces = {}
    for engine in ("matrix", "compiled"):
        built = builder.engine(engine).build()
        X = built.particles.positions
        u = 1e-3 * np.sin(7.0 * X + 3.0 * X[:, ::-1])
        forces[engine] = built.dynamics.internal.forces(0.0, u)
        assert built.dynamics.internal.pair_count == plate(builder).pairs().count
    # Weights are kept once for particles that agree to 1e-13.
    largest = np.abs(forces["matrix"]).max()
    assert np.abs(forces["matrix"] - forces["compiled"]).max() < 1e-11 * largest


def test_every_search_leaves_them_out() -> None:
    """Rows by pieces, moving neighbours, a part of a body and a smaller radius, by one list."""
    body = plate(notched())
    assert body.hidden is not None
    pairs, X = body.pairs(), body.particles.positions
    everyone = np.ones(len(X), dtype=np.bool_)
    columns = np.concatenate([one.columns for one, _ in weighted_chunks(body, everyone)])
    assert np.array_equal(columns, pairs.columns)
    radius = body.smoothing.support_radius
    near = NeighbourSearch(radius, body.hidden).near(X)
    assert 2 * near.pair_count + len(X) == pairs.count
    chosen = np.flatnonzero(X[:, 0] < 0.35)
    part = part_of(body, chosen).pairs()
    place = np.full(len(X), -1)
    place[chosen] = np.arange(len(chosen))
    both = (place[pairs.rows] >= 0) & (place[pairs.columns] >= 0)
    assert np.array_equal(part.columns, place[pairs.columns[both]])
    close = body.pairs(1.5 * H)
    assert close.count == int(np.sum(pairs.distances <= 1.5 * H))


@pytest.mark.parametrize(
    "effect",
    [
        {"type": "artificial-viscosity"},
        {"type": "hourglass-control"},
        {"type": "kelvin-voigt", "time": 1e-3},
        {"type": "bond-failure", "critical_stretch": 10.0},
    ],
    ids=lambda effect: str(effect["type"]),
)
def test_effects_do_not_act_across_a_gap(effect: dict[str, Any]) -> None:
    """A piece that moves as a whole beside one at rest feels nothing."""
    shape = union(box([0.5, 0.4]), box([0.5, 0.4], [0.5 + 0.3 * H, 0.0]))
    builder = Simulation.builder().scheme("corrected")
    builder.body("both", shape=shape, spacing=H).engine("matrix")
    builder.material("linear-elastic", **SOFT).effect(effect).duration(1e-3)
    built = builder.build()
    X = built.particles.positions
    free = X[:, 0] > 0.5 + 0.15 * H
    start = attrs.evolve(
        built.initial,
        positions=X + np.where(free[:, None], [-0.02 * H, 0.01 * H], 0.0),
        velocities=np.where(free[:, None], [-1.0, 0.5], 0.0) * np.ones_like(X),
    )
    response = built.dynamics.respond(0.0, start.positions, start.velocities)
    forces = response.accelerations * built.model.masses[:, None]
    assert np.abs(forces).max() < 1e-10 * SOFT["youngs_modulus"] * H


def test_heat_does_not_jump_a_gap() -> None:
    """Half of the body is at 100 K and stays there exactly, and the other half at 0 K."""
    shape = union(box([0.5, 0.4]), box([0.5, 0.4], [0.5 + 0.3 * H, 0.0]))
    builder = Simulation.builder().body("both", shape=shape, spacing=H).engine("matrix")
    builder.material("linear-elastic", **SOFT).duration(1e-2).outputs(1)
    builder.effect("heat", conductivity=1e6, heat_capacity=1.0, initial="100*(X < 0.51)")
    simulation = builder.build()
    memory = simulation.run().state.memory
    (T,) = (memory[name] for name in memory if "temperature" in name)
    warm = simulation.particles.positions[:, 0] < 0.51
    assert np.abs(T - np.where(warm, 100.0, 0.0)).max() < 1e-10  # K, rounding of sums


def test_pieces_that_meet_in_motion_stay_pieces() -> None:
    """In the updated form neighbours are found anew: by piece, not by distance alone, and the same
    in both engines."""
    shape = construct("shapes", union(box([0.5, 0.4]), box([0.5, 0.4], [1.2, 0.0])))
    particles = construct("discretisations", "lattice").particles(shape, H)
    hidden = hidden_pairs(shape, particles, 3.0 * H, moving=True)
    assert hidden is not None
    assert not len(hidden.keys)  # seven spacings are beyond any support
    X = particles.positions.copy()
    free = X[:, 0] > 1.0
    X[free, 0] -= 0.7
    pairs = neighbour_pairs(X, 3.0 * H, hidden)
    assert not (free[pairs.rows] != free[pairs.columns]).any()
    assert NeighbourSearch(3.0 * H, hidden).near(X).pair_count == (pairs.count - len(X)) // 2


def test_a_part_keeps_its_own() -> None:
    hidden = Hidden(np.array([1, 3, 7]), 3)  # (0, 1), (1, 0), (2, 1)
    rows, columns = np.divmod(np.arange(9), 3)
    assert np.flatnonzero(hidden.between(rows, columns)).tolist() == [1, 3, 7]
    part = hidden.part(np.array([1, 0]))
    assert part.keys.tolist() == [1, 2]


def test_a_convex_body_asks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """What declares to be convex costs no evaluation of its distance, and keeps no list."""
    shape = construct("shapes", box([1.0, 0.5, 0.5]))
    particles = construct("discretisations", "lattice").particles(shape, H)

    def asked(self: Any, points: Array) -> Array:
        raise AssertionError("a convex body was asked")

    monkeypatch.setattr(type(shape), "signed_distance", asked)
    assert hidden_pairs(shape, particles, 3.5 * H) is None


@pytest.mark.parametrize(
    ("vertices", "expected"),
    [
        (TURNED, True),
        (TURNED[::-1], True),
        ([[0, 0], [1, 0], [1, 1], [0.5, 0.9], [0, 1]], False),
    ],
)
def test_a_polygon_knows_whether_it_is_convex(vertices: Any, expected: bool) -> None:
    assert construct("shapes", {"type": "polygon", "vertices": vertices}).convex is expected


def test_symmetric_bodies_keep_symmetric_neighbours() -> None:
    """A slot along the middle of a plate: what the upper half sees, the lower half sees."""
    shape = cut(box([1.0, 1.0]), box([0.55, 0.3 * H], [-0.05, 0.5 - 0.15 * H]))
    particles, rows, columns, hidden = found(shape)
    X = particles.positions
    mirror = {tuple(np.round(x, 6)): k for k, x in enumerate(X)}
    other = np.array([mirror[(round(x, 6), round(1.0 - y, 6))] for x, y in X])
    told = set(zip(rows[hidden].tolist(), columns[hidden].tolist(), strict=True))
    assert {(int(other[p]), int(other[q])) for p, q in told} == told


def test_wider_gaps_hide_no_less() -> None:
    """Of a slot between two rows the number of hidden pairs does not depend on its width, up to a
    spacing: 0.05 to 0.9 spacings leave the same particles."""
    counts = [
        int(found(cut(box([1.0, 1.0]), box([0.5, w * H], [0.0, 0.5 - 0.5 * w * H])))[3].sum())
        for w in (0.05, 0.3, 0.6, 0.9)
    ]
    assert counts[0] > 0
    # Lines that pass the tip are cut a little sooner by a wider slot.
    assert all(a <= b for a, b in pairwise(counts))
