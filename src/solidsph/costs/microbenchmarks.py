"""Microbenchmarks of a calibration; as a program (`python -m`), print one."""

from __future__ import annotations

import os
import sys
import tempfile
import time as clock
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# Only what every run imports, so that `bare` is its memory.
from solidsph.costs.calibration import Calibration, best
from solidsph.costs.process import peak_memory

_SIZE = 1 << 22  # bytes copied at once, beyond the private caches of a core


def _sparse() -> float:
    import numpy as np
    from scipy.sparse import csr_array

    # A band like that of neighbours, small enough for the cache of a core.
    n, width = 1000, 30
    columns = (np.arange(n)[:, None] + np.arange(width)[None, :]) % n
    starts = np.arange(n + 1) * width
    matrix = csr_array((np.ones(n * width), columns.ravel(), starts), shape=(n, n))
    vectors = np.ones((n, 3))
    return best(lambda: matrix @ vectors, 100) / (n * width)


def _calls() -> float:
    import numpy as np

    small = np.ones(8)

    def calls() -> None:
        for _ in range(200):
            np.negative(small, out=small)

    return best(calls, 20) / 200


def _copying(threads: int) -> float:
    import numpy as np

    # Cycle through an array four times as large as one copy.
    source, target = np.ones((4 * threads, _SIZE // 8)), np.empty((4 * threads, _SIZE // 8))

    def share(first: int) -> None:
        for k in range(first, 4 * threads, threads):
            np.copyto(target[k], source[k])

    if threads == 1:
        return best(lambda: share(0), 4) / (4 * _SIZE)
    with ThreadPoolExecutor(threads) as pool:
        seconds = best(lambda: list(pool.map(share, range(threads))), 4, clock.perf_counter)
        return seconds / (4 * threads * _SIZE)


def _filing() -> tuple[float, float]:
    """Time per byte, and per small step of eight datasets [s]."""
    import h5py
    import numpy as np

    rows = np.ones((1 << 17, 3))
    with (
        tempfile.TemporaryDirectory() as folder,
        h5py.File(Path(folder) / "benchmark.h5", "w", libver="latest") as file,
    ):
        data = [
            file.create_dataset(f"{k}", (0, 3), "f8", maxshape=(None, 3), chunks=(4096, 3))
            for k in range(8)
        ]

        def append(values: np.ndarray, where: list) -> None:  # type: ignore[type-arg]
            for dataset in where:
                end = dataset.shape[0]
                dataset.resize(end + len(values), axis=0)
                dataset[end:] = values
            file.flush()

        small = best(lambda: append(rows[:1], data), 10)
        large = best(lambda: append(rows, data[:1]), 2)
    return large / rows.nbytes, small


def _compiling() -> float:
    import numpy as np
    from numba import njit

    def total(a, b):  # type: ignore[no-untyped-def]
        result = 0.0
        for i in range(len(a)):
            for k in range(b.shape[1]):
                result += a[i] * b[i, k]
        return result

    arguments = np.ones(4), np.ones((4, 3))
    njit(total)(*arguments)  # warms the compiler up
    return best(lambda: njit(total)(*arguments), 4)


def _threads() -> int:
    """Number of threads that compiled loops use."""
    wanted = os.environ.get("NUMBA_NUM_THREADS", "")
    if wanted.isdecimal():
        return max(1, int(wanted))
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def measure() -> Calibration:
    """Calibrate this process, which should be fresh."""
    bare = peak_memory()
    compiling = _compiling()
    threads = _threads()
    filing, appending = _filing()
    copying = _copying(1)
    return Calibration(
        sparse=_sparse(),
        calls=_calls(),
        compiling=compiling,
        copying=copying,
        copying_shared=min(copying, _copying(threads)),
        threads=threads,
        filing=filing,
        appending=appending,
        bare=bare,
    )


if __name__ == "__main__":
    sys.stdout.write(measure().to_json())
