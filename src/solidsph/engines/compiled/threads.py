"""Threads of compiled loops, which do not exist in a fork of the process that started them."""

from __future__ import annotations

import os

from numba import get_num_threads

from solidsph.errors import ForkError

# Id of the process in which they were started; empty if they were not.
_started_in: list[int] = []


def started() -> int:
    """Number of threads, which are started if necessary.

    Raises:
        ForkError: this process is a fork of the one that started them.
    """
    check_alive()
    count = int(get_num_threads())
    if count > 1 and not _started_in:
        _started_in.append(os.getpid())
    return count


def check_alive() -> None:
    """Check that threads can run; a loop would otherwise wait for them forever.

    Raises:
        ForkError: this process is a fork of the one that started them.
    """
    if _started_in and _started_in[0] != os.getpid():
        raise ForkError(
            "this process is a fork of one that had started threads for compiled loops, which do "
            "not live on in it; start processes with multiprocessing.get_context('spawn') or "
            "'forkserver', or set NUMBA_NUM_THREADS=1 for all of them, or use the engine 'matrix'"
        )
