"""Beside finite elements: time to 1 % of an equilibrium's answer, ours and scikit-fem's.

    python benchmarks/finite_elements.py                  all cases, about a minute on one core
    python benchmarks/finite_elements.py csm1 --repeats 9

Both sides refine until they are within 1 % and stay there at every finer resolution that is tried,
and the coarsest of these is timed: from the start of the build, or of the mesh, to the number that
is asked for. Our scenes are bare: shape, spacing, material, loads and holds, and `[statics]`. The
finite elements are quadratic, quadrilaterals and hexahedra, with Newton's method and a sparse
factorisation. Both have run once before in the same process: imports are not counted, and the
compiled loops are there. The two take turns.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from math import pi, sqrt
from statistics import median
from typing import Any

import attrs
import numpy as np
from elements import Solid, neo_hookean, saint_venant_kirchhoff
from machine import processor
from skfem import ElementHex2, ElementQuad2, MeshHex, MeshQuad, MeshQuad2
from table import Table

from solidsph import Simulation
from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array
from solidsph.run.outcome import Result
from solidsph.scene.scene_builder import SceneBuilder

ACCURACY = 0.01


@attrs.frozen
class Answer:
    """What a side finds at a resolution."""

    value: float
    unknowns: int


Side = Callable[[int], Answer]
"""An answer by the cells across the thickness, the hole's radius or the side."""


@attrs.frozen
class Contest:
    """A quantity, and who finds it at which resolutions."""

    quantity: str
    reference: float
    ours: Side
    theirs: Side
    our_cells: Sequence[int]
    their_cells: Sequence[int]


def equilibrium(builder: SceneBuilder, read: Callable[[Result], float]) -> Answer:
    """Ours."""
    simulation = builder.duration(1.0).statics().build()
    value = read(simulation.run())
    return Answer(value, int(simulation.dynamics.free.sum()))


def bare(shape: Mapping[str, Any], spacing: float, law: str, E: float, nu: float) -> SceneBuilder:
    """A body and its material."""
    builder = Simulation.builder().body("body", shape=shape, spacing=spacing)
    return builder.material(law, youngs_modulus=E, poissons_ratio=nu, density=1000.0)


# The beam of Turek and Hron's CSM1 [m].
LENGTH, HEIGHT, RADIUS = 0.35, 0.02, 0.05


def csm1(cells: int) -> Answer:
    corner = sqrt(RADIUS**2 - (0.5 * HEIGHT) ** 2) - RADIUS
    shape = {
        "type": "difference",
        "of": {
            "type": "box",
            "lengths": [LENGTH - corner, HEIGHT],
            "origin": [corner, -0.5 * HEIGHT],
        },
        "minus": {"type": "disc", "radius": RADIUS, "centre": [-RADIUS, 0.0]},
    }
    return equilibrium(
        bare(shape, HEIGHT / cells, "saint-venant-kirchhoff", 1.4e6, 0.4)
        .boundary("clamp", where="rim")
        .effect("body-force", acceleration={"y": -2.0}),
        lambda result: float(result.at([[LENGTH, 0.0]]).displacement[0, 1]),
    )


def csm1_by_elements(cells: int) -> Answer:
    def place(s: Array, t: Array) -> tuple[Array, Array]:
        y = HEIGHT * (t - 0.5)
        arc = np.sqrt(RADIUS**2 - y**2) - RADIUS
        return arc + s * (LENGTH - arc), y

    along = np.linspace(0.0, 1.0, 1 + round(cells * LENGTH / HEIGHT))
    mesh = mapped(along, cells, place)
    solid = Solid(mesh, ElementQuad2(), saint_venant_kirchhoff(1.4e6, 0.4))
    x, y = solid.nodes.T
    held = np.repeat((np.hypot(x + RADIUS, y) < RADIUS * (1.0 + 1e-9))[:, None], 2, axis=1)
    rest = solid.equilibrium(held, solid.weight(np.array([0.0, -2.0 * 1000.0])))
    return Answer(float(rest.displacement(np.array([LENGTH, 0.0]))[1]), int((~held).sum()))


# A quarter of a sheet of side 1 m with a hole in its middle [m].
HOLE = 0.2


def hole(cells: int) -> Answer:
    shape = {
        "type": "difference",
        "of": {"type": "box", "lengths": [1.0, 1.0]},
        "minus": {"type": "disc", "radius": HOLE},
    }
    return equilibrium(
        bare(shape, 1.0 / cells, "neo-hookean", 70e6, 0.49)
        .boundary("symmetry", axis="x")
        .boundary("symmetry", axis="y")
        .boundary("traction", where="right", traction={"x": 5e6}),
        lambda result: largest(result.at([[0.0, HOLE]]).stress[0, :2, :2]),
    )


def hole_by_elements(cells: int) -> Answer:
    """Along each half of the arc, and along rays, finer towards the hole."""

    def place(s: Array, t: Array) -> tuple[Array, Array]:
        ray = np.array([np.cos(0.5 * pi * t), np.sin(0.5 * pi * t)])
        x, y = ray * (HOLE + s * (1.0 / np.abs(ray).max(axis=0) - HOLE))
        return x, y

    mesh = mapped(np.linspace(0.0, 1.0, cells + 1) ** 1.5, 2 * cells, place)
    solid = Solid(mesh, ElementQuad2(), neo_hookean(70e6, 0.49))
    held = solid.nodes < 1e-9
    loads = solid.pull(lambda x: x[0] > 1.0 - 1e-9, np.array([5e6, 0.0]))
    rest = solid.equilibrium(held, loads)
    return Answer(largest(rest.cauchy(np.array([0.0, HOLE]))), int((~held).sum()))


def largest(stress: Array) -> float:
    return float(np.linalg.eigvalsh(stress)[-1])


def cantilever(cells: int) -> Answer:
    return equilibrium(
        bare({"type": "box", "lengths": [4.0, 1.0, 1.0]}, 1.0 / cells, "neo-hookean", 1e6, 0.3)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": -2e3}),
        lambda result: float(result.at([[4.0, 0.5, 0.5]]).displacement[0, 1]),
    )


def cantilever_by_elements(cells: int, grading: float = 1.0) -> Answer:
    across = np.linspace(0.0, 1.0, cells + 1)
    along = 4.0 * np.linspace(0.0, 1.0, 4 * cells + 1) ** grading
    mesh = MeshHex.init_tensor(along, across, across)
    solid = Solid(mesh, ElementHex2(), neo_hookean(1e6, 0.3))
    held = np.repeat(solid.nodes[:, :1] < 1e-9, 3, axis=1)
    loads = solid.pull(lambda x: x[0] > 4.0 - 1e-9, np.array([0.0, -2e3, 0.0]))
    rest = solid.equilibrium(held, loads)
    return Answer(float(rest.displacement(np.array([4.0, 0.5, 0.5]))[1]), int((~held).sum()))


def mapped(
    columns: Array, rows: int, place: Callable[[Array, Array], tuple[Array, Array]]
) -> MeshQuad2:
    """Curved quadrilaterals: the nodes of a unit square, moved."""
    mesh = MeshQuad2.from_mesh(MeshQuad.init_tensor(columns, np.linspace(0.0, 1.0, rows + 1)))
    return MeshQuad2(np.array(place(*mesh.doflocs)), mesh.t)


CONTESTS = {
    "csm1": Contest(
        "CSM1: tip", -66.10e-3, csm1, csm1_by_elements, (1, 2, 3, 4, 6, 8), (1, 2, 3, 4)
    ),
    "hole": Contest(
        "sheet with a hole, nu 0.49: peak stress",
        16.74e6,
        hole,
        hole_by_elements,
        (10, 15, 20, 25, 30, 40, 50, 60),
        (4, 6, 7, 8, 9, 10, 12, 16),
    ),
    # The finite elements of this file, refined towards the clamp up to 6 across and extrapolated.
    "cantilever": Contest(
        "cantilever in space: tip",
        -0.5199,
        cantilever,
        cantilever_by_elements,
        (2, 3, 4, 5, 6, 8),
        (1, 2, 3),
    ),
}


def coarsest(side: Side, cells: Sequence[int], reference: float) -> tuple[int, Answer] | None:
    """The coarsest resolution from which on all are accurate, and what it finds."""
    found: tuple[int, Answer] | None = None
    for count in reversed(cells):
        try:
            there = side(count)
        except SolidsphError:  # too coarse to be built
            break
        print(f"  {count:3d}  {there.value / reference - 1.0:+.4f}", flush=True)
        if abs(there.value / reference - 1.0) > ACCURACY:
            break
        found = count, there
    return found


def timed(sides: Sequence[Callable[[], object]], repeats: int) -> list[tuple[float, float]]:
    """Medians of the time on the wall and of the processor's of each [s], in turns."""
    samples: list[list[tuple[float, float]]] = [[] for _ in sides]
    for _ in range(repeats):
        for side, own in zip(sides, samples, strict=True):
            wall, spent = time.perf_counter(), time.process_time()
            side()
            own.append((time.perf_counter() - wall, time.process_time() - spent))
    return [(median(wall for wall, _ in own), median(spent for _, spent in own)) for own in samples]


def rows(contest: Contest, repeats: int) -> list[tuple[str, ...]]:
    """Of one contest, ours and theirs."""
    both = [(contest.ours, contest.our_cells), (contest.theirs, contest.their_cells)]
    found = [coarsest(side, cells, contest.reference) for side, cells in both]
    best = [one for one in found if one is not None]
    if len(best) < 2:
        raise SystemExit(f"{contest.quantity}: a side does not reach 1 %")
    times = timed(
        [lambda side=side, n=n: side(n) for (side, _), (n, _) in zip(both, best, strict=True)],
        repeats,
    )
    table = []
    sides = zip(("solidsph", "finite elements"), best, times, times[::-1], strict=True)
    for whose, (count, there), own, others in sides:
        error = there.value / contest.reference - 1.0
        cells = f"{count}", f"{there.unknowns}", f"{100.0 * error:+.2f}"
        seconds = (f"{one:.3f}" for one in own)
        ratios = (f"{one / another:.2f}" for one, another in zip(own, others, strict=True))
        table.append((contest.quantity, whose, *cells, *seconds, *ratios))
    return table


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", nargs="*", help=f"of {', '.join(CONTESTS)}; all by default")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    unknown = set(options.which) - set(CONTESTS)
    if unknown:
        parser.error(f"no contest {', '.join(sorted(unknown))}; take {', '.join(CONTESTS)}")
    lines = [
        line
        for name, contest in CONTESTS.items()
        if not options.which or name in options.which
        for line in rows(contest, options.repeats)
    ]
    table = Table(
        "Time to 1 %, beside quadratic finite elements",
        (
            "quantity",
            "by",
            "cells",
            "unknowns",
            "error %",
            "processor s",
            "wall s",
            "over the other's: processor",
            "wall",
        ),
        tuple(lines),
        f"{processor()}; medians of {options.repeats} runs in turns. Cells: across the beam, along "
        "a side of the quarter sheet (from the hole to an edge), across the cantilever.",
    )
    print(table.text())


if __name__ == "__main__":
    main()
