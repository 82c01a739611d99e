"""Whether a particle costs the same in a small body and in a large one."""

from __future__ import annotations

import time
from collections.abc import Callable

from bodies import CELLS, body, displacements
from loops import Loop, compiled_loop
from table import Table
from timing import alternately

REPEATS = 15


def by_size(sizes: list[int], threads: int) -> Table:
    """Cost of a particle and of a pair by size, on a 3D lattice, all sizes timed in turns."""
    counts: dict[int, int] = {}
    loops: dict[int, Loop] = {}
    for size in sizes:
        block = body(CELLS[3][size], "lattice")
        counts[size] = block.particles.count
        loops[size] = compiled_loop(block, displacements(block), "float64", threads)
    times = alternately({size: loop.run for size, loop in loops.items()}, REPEATS, of=min)
    work = {size: _processor_time(loop.run, times[size]) for size, loop in loops.items()}
    rows = []
    for size, loop in loops.items():
        n = counts[size]
        rows.append(
            (
                f"{n}",
                f"{loop.pairs / n:.1f}",
                f"{1e9 * times[size] / n:.1f}",
                f"{1e9 * times[size] / loop.pairs:.3f}",
                f"{1e9 * work[size] / n:.1f}",
                f"{1e9 * work[size] / loop.pairs:.3f}",
            )
        )
    measured = [
        ratio
        for each in (times, work)
        for ratio in (
            _spread([each[size] / counts[size] for size in sizes]),
            _spread([each[size] / loops[size].pairs for size in sizes]),
        )
    ]
    return Table(
        f"Cost by size: 3D lattice, float64, {threads} threads",
        (
            "particles",
            "pairs a particle",
            "ns a particle",
            "ns a pair",
            "processor ns a particle",
            "processor ns a pair",
        ),
        tuple(rows),
        f"Least of {REPEATS} samples, in turns. Dearest to cheapest: {measured[0]:.2f} a particle, "
        f"{measured[1]:.2f} a pair; by processor time, which other programs disturb less, "
        f"{measured[2]:.2f} and {measured[3]:.2f}.",
    )


def _spread(costs: list[float]) -> float:
    return max(costs) / min(costs)


def _processor_time(run: Callable[[], object], seconds: float) -> float:
    """Processor time of one run [s], all threads added up."""
    calls = max(3, int(0.3 / seconds))
    start = time.process_time()
    for _ in range(calls):
        run()
    return (time.process_time() - start) / calls
