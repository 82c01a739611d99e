"""Threads that share compiled loops. A fork of the process that started them has none of them."""

from __future__ import annotations

import os

from numba import get_num_threads

from solidsph.errors import ForkError

# The process in which they were started; none if they were not.
_started_in: list[int] = []


def started() -> int:
    """How many there are; they are started if they were not.

    Raises:
        ForkError: this process is a fork of the one that they were started in.
    """
    check_alive()
    count = int(get_num_threads())
    if count > 1 and not _started_in:
        _started_in.append(os.getpid())
    return count


def check_alive() -> None:
    """That a loop that several threads share can be run: it would never end without them.

    Raises:
        ForkError: it cannot, in a fork.
    """
    if _started_in and _started_in[0] != os.getpid():
        raise ForkError(
            "this process is a fork of one that had started threads for compiled loops, which do "
            "not live on in it; start processes with multiprocessing.get_context('spawn') or "
            "'forkserver', or set NUMBA_NUM_THREADS=1 for all of them, or use the engine 'matrix'"
        )
