"""A task in a process of its own: its peak of memory, and its crash, are nobody else's."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from typing import IO

from solidsph.studies.runner import Lost
from solidsph.studies.scratch_folder import ScratchFolder
from solidsph.studies.task_lines import encode_outcome

_CHUNK = 65536


class FreshProcess:
    """A process that carries out one packed task. It ends when this one closes it, or dies."""

    def __init__(self, line: str) -> None:
        self._answer = b""
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  # closed by close()
        self._scratch = ScratchFolder()  # for records, which a run that is killed leaves behind
        self._process = subprocess.Popen(
            # -P: no module of the current folder stands in for one that is installed.
            [sys.executable, "-P", "-m", "solidsph.studies.run_task"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, "TMPDIR": str(self._scratch.path)},
            start_new_session=True,  # an interrupt from the terminal is for the sweep alone
        )
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(line.encode("ascii") + b"\n")
            self._process.stdin.flush()  # not closed: an open pipe says that someone waits
        except BrokenPipeError:
            pass  # it has died already, as its outcome will say
        except BaseException:
            self.close()
            raise

    def fileno(self) -> int:
        """Readable when there is an answer, or when it has ended."""
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    def is_over(self) -> bool:
        """Take what there is to read; whether that was the end."""
        part = os.read(self.fileno(), _CHUNK)
        self._answer += part
        return not part

    def reply(self) -> str:
        """One line for `packing.heard`, once it is over."""
        code = self._process.wait()
        if self._answer.endswith(b"\n"):
            return self._answer.decode("ascii")
        return encode_outcome(Lost(_ended(code, self._last_words())))

    def close(self) -> None:
        """End it if it still runs, and remove whatever it leaves."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._errors):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()
        self._scratch.close()

    def _last_words(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "")


def _ended(code: int, last_words: str) -> str:
    how = f"by signal {-code}" if code < 0 else f"with code {code}"
    if code == -9:
        how += ", as it does when memory runs out"
    return f"the process ended {how}" + (f": {last_words}" if last_words else "")
