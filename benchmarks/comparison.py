"""The compiled engine beside the yardstick, a careful plain C loop, timed in turns.

The block of 40 x 40 x 64 particles with 80 neighbours, on a lattice and disordered.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from bodies import body, displacements
from loops import Loop, compiled_loop
from table import Table
from timing import alternately
from yardstick import yardstick

BLOCK = (40, 40, 64)
REPEATS = 21
# Relative to the largest force. In single precision the displacement, half a spacing here, is
# rounded to 6e-8 of itself, and its gradient to some times that.
AGREEMENT = {"float64": 1e-12, "float32": 1e-4}


def beside_the_yardstick(arrangement: str, threads: list[int], precisions: list[str]) -> Table:
    """Time of an evaluation by each loop, and its ratio to the yardstick's on as many threads."""
    block = body(BLOCK, arrangement)
    u, n = displacements(block), block.particles.count
    reference = yardstick(block)
    expected = reference(u, 1).copy()
    runs: dict[Any, Callable[[], object]] = {}
    loops: dict[Any, Loop] = {}
    for count in threads:
        runs["yardstick", count] = lambda count=count: reference(u, count)
        for precision in precisions:
            loop = compiled_loop(block, u, precision, count)
            missed = np.abs(loop.run() - expected).max() / np.abs(expected).max()
            assert missed <= AGREEMENT[precision], f"the yardstick does other work: {missed:.1e}"
            loops[precision, count], runs[precision, count] = loop, loop.run
    times = alternately(runs, REPEATS)
    pairs = next(iter(loops.values())).pairs
    rows = []
    for (name, count), seconds in times.items():
        loop = loops.get((name, count))
        rows.append(
            (
                "plain C loop" if loop is None else f"compiled, {name}",
                f"{count}",
                f"{1e3 * seconds:.2f}",
                f"{1e9 * seconds / pairs:.2f}",
                f"{times['yardstick', count] / seconds:.2f}",
                "" if loop is None else f"{loop.bytes / n:.0f}",
            )
        )
    return Table(
        f"Beside a plain C loop: {' x '.join(map(str, BLOCK))}, {arrangement}",
        ("loop", "threads", "ms an evaluation", "ns a pair", "times as fast", "bytes a particle"),
        tuple(rows),
        f"{n} particles, {pairs / n - 1:.1f} neighbours, neo-Hookean, bent; medians, in turns.",
    )
