"""How fast, in how much memory, and against what: every benchmark, or those that are named.

python benchmarks/bench.py                              all, about ten minutes on two cores
python benchmarks/bench.py yardstick                    beside a plain C loop
python benchmarks/bench.py throughput --dimensions 3 --sizes 1000 100000 --engines compiled
python benchmarks/bench.py --write docs/benchmarks.md   and write the page of the docs
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numba
from bodies import ARRANGEMENTS, SIZES
from comparison import AGREEMENT, beside_the_yardstick
from footprint import footprint
from growth import by_size
from machine import machine_table
from page import write_page
from steps import whole_steps
from table import Table
from throughput import MOST_DISORDERED, Choice, throughput

BENCHMARKS = ("yardstick", "steps", "growth", "footprint", "throughput")


def tables(which: list[str], choice: Choice) -> Iterator[Table]:
    """The tables of the benchmarks named, each as soon as it is there."""
    yield machine_table(choice.threads)
    most = max(choice.threads)
    if "yardstick" in which:
        for arrangement in choice.arrangements:
            yield beside_the_yardstick(arrangement, choice.threads, choice.precisions)
    if "steps" in which:
        yield whole_steps(choice.engines, choice.threads)
    if "growth" in which:
        yield by_size([size for size in choice.sizes if size >= 10_000], most)
    if "footprint" in which:
        disordered = max(SIZES) if choice.large else MOST_DISORDERED
        yield footprint(choice.sizes, choice.arrangements, disordered)
    if "throughput" in which:
        for dimension in choice.dimensions:
            for arrangement in choice.arrangements:
                yield throughput(choice, dimension, arrangement)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    most = numba.config.NUMBA_NUM_THREADS
    axes = {
        "engines": (str, ["compiled", "matrix"]),
        "dimensions": (int, [3, 2, 1]),
        "precisions": (str, list(AGREEMENT)),
        "threads": (int, sorted({1, min(2, most)})),
        "sizes": (int, list(SIZES)),
        "arrangements": (str, list(ARRANGEMENTS)),
    }
    parser.add_argument("which", nargs="*", help=f"of {', '.join(BENCHMARKS)}; all by default")
    for name, (kind, values) in axes.items():
        known = None if name == "threads" else values
        parser.add_argument(f"--{name}", type=kind, nargs="+", default=values, choices=known)
    parser.add_argument(
        "--large", action="store_true", help="also what takes gigabytes and minutes to build"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="write the tables as Markdown")
    options = parser.parse_args()
    which = options.which or list(BENCHMARKS)
    unknown = set(which) - set(BENCHMARKS)
    if unknown:
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; take {', '.join(BENCHMARKS)}")
    if max(options.threads) > most:
        parser.error(f"{max(options.threads)} threads asked for, this machine offers {most}")
    choice = Choice(**{name: getattr(options, name) for name in axes}, large=options.large)
    done = []
    for table in tables(which, choice):
        print(f"{table.text()}\n", flush=True)
        done.append(table)
    if options.write:
        write_page(options.write, done)


if __name__ == "__main__":
    main()
