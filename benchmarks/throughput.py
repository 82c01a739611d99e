"""Pair throughput of the engines beside a plain C loop, timed alternately in the same run.

    python benchmarks/throughput.py            the block of 40 x 40 x 64, and a disordered one
    python benchmarks/throughput.py --sizes    cost and memory a particle from 1e4 to 1e6

A 3D block, spacing 0.01 m, cover 2.6, neo-Hookean, in the velocity field of a bending wave. Read
the ratios: absolute times on a shared machine mean little.
"""

from __future__ import annotations

import argparse
import gc
import resource
import time
from collections.abc import Callable, Mapping
from typing import Any

import numba
import numpy as np
from yardstick import yardstick

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.parts import construct
from solidsph.smoothing import smoothing_kernel

SPACING, COVER = 0.01, 2.6
MATERIAL = {
    "type": "neo-hookean",
    "density": 1000.0,
    "youngs_modulus": 2e6,
    "poissons_ratio": 0.3975,
}
ARRANGEMENTS: Mapping[str, Any] = {
    "lattice": {"type": "lattice"},
    "disordered": {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1},
}
BLOCK = (40, 40, 64)
LINES = [(16, 16, 40), (32, 32, 100), (100, 100, 100)]  # particles along each axis, 1e4 to 1e6
REPEATS = 21
# Relative to the largest force. In single precision the displacement, half a spacing here, is
# rounded to 6e-8 of itself, and its gradient to some times that.
AGREEMENT = {"float64": 1e-12, "float32": 1e-4}


def block(cells: tuple[int, ...], arrangement: Any) -> Body:
    shape = construct("shapes", {"type": "box", "lengths": [SPACING * n for n in cells]})
    particles = construct("discretisations", arrangement).particles(shape, SPACING)
    return Body(
        name="block",
        extent=slice(0, particles.count),
        particles=particles,
        smoothing=smoothing_kernel(construct("kernels", "cubic-spline"), 3, COVER * SPACING),
        material=construct("materials", MATERIAL),
        formulation=construct("formulations", "total-lagrangian"),
    )


def displacements(body: Body) -> Array:
    """What v_y = 0.01 c0 sin(pi x / (2 Lx)) has done after the time of a wave across the block."""
    X = body.particles.positions
    length = X[:, 0].max() + 0.5 * SPACING
    u = np.zeros_like(X)
    u[:, 1] = 0.01 * length * np.sin(0.5 * np.pi * X[:, 0] / length)
    return u


def alternately(
    runs: Mapping[Any, Callable[[], object]], repeats: int = REPEATS
) -> dict[Any, float]:
    """Median time of each run [s]; they take turns, so that a slow moment meets all."""
    times: dict[Any, list[float]] = {key: [] for key in runs}
    for _ in range(repeats):
        for key, run in runs.items():
            start = time.perf_counter()
            run()
            times[key].append(time.perf_counter() - start)
    return {key: float(np.median(values)) for key, values in times.items()}


def prepared(body: Body, precision: str, threads: int) -> tuple[CompiledForces, float]:
    """The engine's forces, and the time until the first ones are there [s]."""
    numba.set_num_threads(threads)
    start = time.perf_counter()
    forces = CompiledEngine(precision).prepare([body], [])
    assert isinstance(forces, CompiledForces)
    forces.forces(0.0, np.zeros_like(body.particles.positions))
    return forces, time.perf_counter() - start


def beside_the_yardstick(name: str, threads: list[int]) -> None:
    body = block(BLOCK, ARRANGEMENTS[name])
    u, n = displacements(body), body.particles.count
    reference = yardstick(body)
    expected = reference(u, 1).copy()
    runs: dict[Any, Callable[[], object]] = {}
    engines = {}
    for count in threads:
        runs["yardstick", count] = lambda count=count: reference(u, count)
        for precision in AGREEMENT:
            forces, first = prepared(body, precision, count)
            missed = np.abs(forces.forces(0.0, u) - expected).max() / np.abs(expected).max()
            assert missed <= AGREEMENT[precision], f"the yardstick does other work: {missed:.1e}"

            def run(forces: CompiledForces = forces, count: int = count) -> object:
                numba.set_num_threads(count)
                return forces.forces(0.0, u)

            runs[precision, count] = run
            engines[precision, count] = forces, first
    times = alternately(runs)
    pairs = next(iter(engines.values()))[0].pair_count
    print(f"\n{name}: {n} particles, {pairs / n - 1:.1f} neighbours")
    print(
        "  loop       threads  ms a step  ns a pair  of the yardstick  bytes a particle  first step"
    )
    for (loop, count), seconds in times.items():
        forces, first = engines.get((loop, count), (None, None))
        memory = "" if forces is None else f"{forces.bytes / n:16.0f}  {first:8.1f} s"
        print(
            f"  {loop:10} {count:7d}  {1e3 * seconds:9.2f}  {1e9 * seconds / pairs:9.3f}"
            f"  {seconds / times['yardstick', count]:16.2f}  {memory}"
        )


def by_size(name: str, threads: int) -> None:
    print(f"\n{name}, {threads} threads, float64")
    print("  particles  ns a particle  ns a pair  bytes a particle  build  peak of the process")
    for cells in LINES:
        body = block(cells, ARRANGEMENTS[name])
        u, n = displacements(body), body.particles.count
        forces, first = prepared(body, "float64", threads)
        seconds = alternately({0: lambda forces=forces, u=u: forces.forces(0.0, u)})[0]
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"  {n:9d}  {1e9 * seconds / n:13.1f}  {1e9 * seconds / forces.pair_count:9.3f}"
            f"  {forces.bytes / n:16.0f}  {first:5.1f} s"
            f"  {peak:8.0f} MiB"
        )
        del forces, body, u
        gc.collect()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", action="store_true", help="cost by size instead")
    most = numba.config.NUMBA_NUM_THREADS
    parser.add_argument("--threads", type=int, nargs="+", default=sorted({1, min(2, most)}))
    options = parser.parse_args()
    for name in ARRANGEMENTS:
        if options.sizes:
            if name == "lattice":
                by_size(name, max(options.threads))
        else:
            beside_the_yardstick(name, options.threads)


if __name__ == "__main__":
    main()
