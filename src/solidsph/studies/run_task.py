"""python -m solidsph.studies.run_task: the process that carries out one task.

The task is the first line of the standard input, its outcome the only line of the standard output.
The input stays open for as long as anyone waits for the outcome.
"""

from __future__ import annotations

import fcntl
import os
import select
import signal
import sys

from solidsph.studies.point import Point
from solidsph.studies.runner import Lost, run_task
from solidsph.studies.task_lines import decode_task, encode_outcome


def main() -> None:
    """Carry out one task, then leave at once."""
    answer = os.dup(1)
    os.dup2(2, 1)  # whatever a run prints goes elsewhere
    line = sys.stdin.buffer.readline()
    _end_with_the_other_end(0)
    text = encode_outcome(_outcome(line)).encode("ascii") + b"\n"
    while text:
        text = text[os.write(answer, text) :]
    sys.stderr.flush()
    os._exit(0)  # nothing that goes wrong from here on matters


def _outcome(line: bytes) -> Point | Lost:
    try:
        task = decode_task(line)
    except Exception as cause:
        return Lost(f"{type(cause).__name__}: {cause}")
    return run_task(task)


def _end_with_the_other_end(pipe: int) -> None:
    """Die as soon as whoever holds the other end of `pipe` closes it, or dies.

    By a signal, because a compiled loop lets no thread of Python run for as long as it takes.
    """
    signal.signal(signal.SIGIO, signal.SIG_DFL)  # which is to end the process
    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([pipe], [], [], 0.0)[0]:  # it has been closed before the signal was asked for
        os._exit(1)


if __name__ == "__main__":
    main()
