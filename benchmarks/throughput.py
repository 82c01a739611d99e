"""Pair throughput by engine, dimension, arrangement, size, precision and number of threads."""

from __future__ import annotations

from typing import Any

import attrs
from bodies import CELLS, body, displacements
from loops import Loop, compiled_loop, least_traffic, matrix_loop, multiply_adds
from machine import rates
from table import Table
from timing import alternately

REPEATS = 15
# Beyond these the matrices and the rows take gigabytes and minutes to build.
MOST_OF_MATRIX, MOST_DISORDERED = 100_000, 100_000


@attrs.frozen
class Choice:
    """What is to be timed, along each axis."""

    engines: list[str]
    dimensions: list[int]
    precisions: list[str]
    threads: list[int]
    sizes: list[int]
    arrangements: list[str]
    large: bool = False  # also the matrix engine and disordered bodies at sizes that take minutes


def throughput(choice: Choice, dimension: int, arrangement: str) -> Table:
    """Cost of a pair for one dimension and arrangement."""
    rows: list[tuple[str, ...]] = []
    for size in choice.sizes:
        if arrangement == "disordered" and size > MOST_DISORDERED and not choice.large:
            continue
        rows += _rows(choice, dimension, arrangement, size)
    return Table(
        f"Pair throughput: {dimension}D, {arrangement}",
        (
            "engine",
            "particles",
            "threads",
            "ns a pair",
            "1e6 particle-steps/s",
            "of memory bandwidth",
            "of multiply-adds",
            "bytes a particle",
            "build s",
        ),
        tuple(rows),
        f"Least of {REPEATS} samples. Of memory bandwidth: what an evaluation must move once, "
        "against the triad of this run; above 1 where caches hold it. Of multiply-adds: "
        f"{multiply_adds(dimension)} a pair, against the peak of this run.",
    )


def _rows(choice: Choice, dimension: int, arrangement: str, size: int) -> list[tuple[str, ...]]:
    block = body(CELLS[dimension][size], arrangement)
    u, n = displacements(block), block.particles.count
    loops: dict[Any, Loop] = {}
    if "compiled" in choice.engines:
        # Many particles take long to prepare: then by the most threads only.
        threads = choice.threads if size <= MOST_OF_MATRIX else [max(choice.threads)]
        for precision in choice.precisions:
            for count in threads:
                loops["compiled", precision, count] = compiled_loop(block, u, precision, count)
    if "matrix" in choice.engines and (size <= MOST_OF_MATRIX or choice.large):
        loops["matrix", "float64", 1] = matrix_loop(block, u)
    times = alternately({key: loop.run for key, loop in loops.items()}, REPEATS, of=min)
    rows = []
    for key, seconds in times.items():
        (engine, precision, count), loop = key, loops[key]
        rate = rates(count)
        done = multiply_adds(dimension) * loop.pairs / seconds
        rows.append(
            (
                engine if engine == "matrix" else f"{engine}, {precision}",
                f"{n}",
                f"{count}",
                f"{1e9 * seconds / loop.pairs:.2f}",
                f"{1e-6 * n / seconds:.2f}",
                f"{least_traffic(loop, block) / seconds / rate.triad:.2f}",
                f"{done / rate.multiply_adds[precision]:.3f}",
                f"{loop.bytes / n:.0f}",
                f"{loop.build:.2f}",
            )
        )
    return rows
