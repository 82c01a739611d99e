"""python -m solidsph.studies.run_task: the process of one task.

The task is the first line of the standard input, its outcome the only line of the standard output.
The process ends when its input is closed.
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
    """Run one task, then exit at once."""
    answer = os.dup(1)
    os.dup2(2, 1)  # other output of the run goes to the standard error
    line = sys.stdin.buffer.readline()
    _exit_when_closed(0)
    text = encode_outcome(_outcome(line)).encode("ascii") + b"\n"
    while text:
        text = text[os.write(answer, text) :]
    sys.stderr.flush()
    os._exit(0)  # errors of the shutdown do not matter


def _outcome(line: bytes) -> Point | Lost:
    try:
        task = decode_task(line)
    except Exception as cause:
        return Lost(f"{type(cause).__name__}: {cause}")
    return run_task(task)


def _exit_when_closed(pipe: int) -> None:
    """End this process as soon as the other end of `pipe` is closed.

    A signal does it, because no thread of Python runs during a compiled loop.
    """
    signal.signal(signal.SIGIO, signal.SIG_DFL)  # the default is to end the process
    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([pipe], [], [], 0.0)[0]:  # closed before the signal was set up
        os._exit(1)


if __name__ == "__main__":
    main()
