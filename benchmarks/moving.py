"""A step of the updated Lagrangian form by either engine, timed alternately in the same run.

    python benchmarks/moving.py

Bodies that stretch by half a hundredth of their spacing a step, as one in a wave at a hundredth of
its own speed does. Times are of the processor, in one thread, which neither engine leaves; read
the ratios.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.engines.compiled.moving.body import MovingBody
from solidsph.engines.matrix import MatrixEngine
from solidsph.interfaces.body import Body
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.registry.construct import construct

SPACING = 0.01
A_STEP = 0.005  # of the fastest particle [spacings]
MATERIAL = {
    "type": "neo-hookean",
    "density": 1000.0,
    "youngs_modulus": 2e6,
    "poissons_ratio": 0.3,
}
# Particles along each axis, kernel, cover: the paper's bar, then a sheet and a block.
BODIES: list[tuple[tuple[int, ...], str, float]] = [
    ((61,), "modified-mollifier", 5.5),
    ((50, 50), "cubic-spline", 2.6),
    ((20, 20, 20), "cubic-spline", 2.6),
]
OPERATORS = [("difference", "plain"), ("corrected", "variational")]
AGREEMENT = 1e-12  # relative to the largest force
REPEATS = 31


def moving_body(cells: tuple[int, ...], kernel: str, cover: float, operators: Any) -> Body:
    d = len(cells)
    lengths = [SPACING * n for n in cells]
    shape = {"type": "interval", "length": lengths[0]} if d == 1 else None
    shape = shape or {"type": "box", "lengths": lengths}
    lattice = construct("discretisations", {"type": "lattice"})
    particles = lattice.particles(construct("shapes", shape), SPACING)
    gradient, divergence = operators
    form = {"type": "updated-lagrangian", "gradient": gradient, "divergence": divergence}
    return Body(
        name="body",
        extent=slice(0, particles.count),
        particles=particles,
        smoothing=smoothing_kernel(construct("kernels", kernel), d, cover * SPACING),
        material=construct("materials", MATERIAL),
        formulation=construct("formulations", form),
    )


def path(body: Body, step: int) -> Array:
    """Displacements after some steps."""
    X = body.particles.positions
    return step * A_STEP * SPACING * X / np.abs(X).max()


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    start = time.thread_time()
    answer = run()
    return time.thread_time() - start, answer


def prepared(body: Body) -> CompiledForces:
    forces = CompiledEngine().prepare([body], [])
    assert isinstance(forces, CompiledForces)
    forces.forces(0.0, path(body, 0))
    return forces


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    print(
        "particles    pairs  operators               matrix   compiled  ratio"
        "  with a new list  first step"
    )
    for cells, kernel, cover in BODIES:
        for operators in OPERATORS:
            body = moving_body(cells, kernel, cover, operators)
            first, compiled = timed(lambda body=body: prepared(body))
            matrix = MatrixEngine().prepare([body], [])
            (part,) = compiled.parts
            assert isinstance(part, MovingBody)
            times: dict[str, list[float]] = {"matrix": [], "kept": [], "new": []}
            list_of = part.search.list_origin
            for step in range(1, REPEATS * (1 if len(cells) > 1 else 10)):
                u = path(body, step)
                seconds, expected = timed(lambda u=u, matrix=matrix: matrix.forces(0.0, u))
                times["matrix"].append(seconds)
                seconds, found = timed(lambda u=u, forces=compiled: forces.forces(0.0, u))
                times["kept" if part.search.list_origin is list_of else "new"].append(seconds)
                list_of = part.search.list_origin
                missed = np.abs(found - expected).max() / np.abs(expected).max()
                assert missed <= AGREEMENT, f"the engines differ: {missed:.1e}"
            us = {key: 1e6 * float(np.median(values)) for key, values in times.items()}
            print(
                f"{body.particles.count:9d}  {compiled.pair_count:7d}  {'/'.join(operators):22}"
                f"  {us['matrix']:6.0f} us  {us['kept']:6.0f} us  {us['matrix'] / us['kept']:5.1f}"
                f"  {us['new']:12.0f} us  {first:8.1f} s"
            )


if __name__ == "__main__":
    main()
