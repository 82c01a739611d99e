"""Equilibria of a cantilever in space by size: time, products with the tangent, memory.

    python benchmarks/statics.py [--most PARTICLES] [--direct PARTICLES] [--nu NU]

Each runs in a process of its own, so that the peak of memory is its own. Bodies of up to `--direct`
particles are also solved by a factorisation.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys

from solidsph import Simulation
from solidsph.statics import equilibrium

ACROSS = (5, 9, 12, 19, 28, 40)


def measured(across: int, nu: float, solver: str) -> str:
    """One row of the table, of a beam with so many spacings across."""
    simulation = (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [4.0, 1.0, 1.0]}, spacing=1.0 / across)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=nu, density=1e3)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": -2e3})
        .duration(1.0)
        .statics(solver=solver)
        .build()
    )
    result = equilibrium(simulation, solver=solver)
    tip = float(result.state.positions[:, 1].min())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return (
        f"{simulation.particles.count:9d}  {solver:9}  {result.seconds:8.2f}  "
        f"{result.iterations:6d}  {result.products:8d}  {peak:7.2f}  {tip:.9f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=40_000, help="particles of the largest")
    parser.add_argument("--direct", type=int, default=1_000, help="particles solved directly")
    parser.add_argument("--nu", type=float, default=0.3, help="Poisson's ratio")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(measured(int(options.one[0]), options.nu, options.one[1]))
        return
    print("particles  solver      time [s]  Newton  products  [GiB]    lowest point [m]")
    for across in ACROSS:
        particles = (4 * across + 1) * (across + 1) ** 2
        if particles > options.most:
            break
        for solver in ("direct", "iterative"):
            if solver == "direct" and particles > options.direct:
                continue
            command = [sys.executable, __file__, "--nu", str(options.nu)]
            subprocess.run([*command, "--one", str(across), solver], check=True)


if __name__ == "__main__":
    main()
