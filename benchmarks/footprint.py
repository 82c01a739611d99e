"""Memory and time of a whole run, each in a process of its own so that peaks do not mix.

python benchmarks/footprint.py lattice 1000000      what one process measures, as JSON
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bodies import ARRANGEMENTS, CELLS, COVER, MATERIAL, SPACING, shape
from table import Table

import solidsph.engines.compiled.engine  # noqa: F401 - part of what importing takes
from solidsph import Simulation
from solidsph.system.cache import CACHE

_STEPS = 2


def footprint(sizes: list[int], arrangements: list[str], most_disordered: int) -> Table:
    """Growth of a process that builds a 3D scene and runs it, and how long the first step takes."""
    rows = []
    for arrangement in arrangements:
        for size in sizes:
            if arrangement == "disordered" and size > most_disordered:
                continue
            command = [sys.executable, __file__, arrangement, str(size)]
            with tempfile.TemporaryDirectory() as empty:  # so that nothing has been compiled before
                first = {**os.environ, CACHE: empty}
                done = subprocess.run(command, check=True, capture_output=True, env=first)
            found = json.loads(done.stdout)
            n = found["particles"]
            rows.append(
                (
                    arrangement,
                    f"{n}",
                    f"{found['engine'] / n:.0f}",
                    f"{found['built'] / n:.0f}",
                    f"{found['run'] / n:.0f}",
                    f"{found['run'] / 2**20:.0f}",
                    f"{found['build_seconds']:.1f}",
                    f"{found['first_seconds']:.1f}",
                )
            )
    return Table(
        "Memory, and time to the first step: 3D, compiled engine, float64",
        (
            "arrangement",
            "particles",
            "engine's arrays, bytes a particle",
            "peak while building",
            "peak while running",
            "the same, MiB",
            "build s",
            "first step s",
        ),
        tuple(rows),
        "Peaks are the growth of the process beyond what imports take, bytes a particle; compiled "
        f"code is in them. The run is of {_STEPS} steps with one output. The first step counts "
        "from the beginning of the build to the end of one step, compilation included.",
    )


def _measured(arrangement: str, size: int) -> dict[str, Any]:
    imported = _peak()
    begun = time.perf_counter()
    simulation = _simulation(arrangement, size)
    build_seconds = time.perf_counter() - begun
    built = _peak() - imported
    state = simulation.start()
    simulation.integrator.advance(state, simulation.dynamics, simulation.step_size)
    first_seconds = time.perf_counter() - begun
    del state
    simulation.run()
    return {
        "particles": simulation.particles.count,
        "engine": simulation.dynamics.internal.bytes,  # type: ignore[attr-defined]
        "built": built,
        "run": _peak() - imported,
        "build_seconds": build_seconds,
        "first_seconds": first_seconds,
    }


def _simulation(arrangement: str, size: int) -> Simulation:
    step = 1e-4  # within the CFL step, 1.5e-4 s
    return (
        Simulation.builder()
        .body(
            "block",
            shape=shape(CELLS[3][size]),
            spacing=SPACING,
            discretisation=ARRANGEMENTS[arrangement],
        )
        .kernel("cubic-spline", cover=COVER)
        .material(MATERIAL)
        .formulation("total-lagrangian")
        .boundary("clamp", where="left")
        .initial(velocity={"y": "0.1*X"})
        .integrator("central-difference", time_step=step)
        .engine("compiled")
        .duration(_STEPS * step)
        .outputs(1)
        .build()
    )


def _peak() -> int:
    """Largest memory that this process has had [B]."""
    # What `getrusage` tells on Linux may be that of the process that started this one.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM"):
                return 1024 * int(line.split()[1])
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    print(json.dumps(_measured(sys.argv[1], int(sys.argv[2]))))
