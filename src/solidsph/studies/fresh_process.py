"""A task in its own process, so that its peak of memory and its crash concern no other."""

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
    """A process that runs one encoded task. It ends when this process closes it, or dies."""

    def __init__(self, line: str) -> None:
        self._answer = b""
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  # closed by close()
        self._scratch = ScratchFolder()  # for records, which a killed run does not remove
        self._process = subprocess.Popen(
            # -P: modules in the current folder do not hide installed ones.
            [sys.executable, "-P", "-m", "solidsph.studies.run_task"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, "TMPDIR": str(self._scratch.path)},
            start_new_session=True,  # an interrupt from the terminal reaches the sweep only
        )
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(line.encode("ascii") + b"\n")
            self._process.stdin.flush()  # not closed: the process ends when the pipe does
        except BrokenPipeError:
            pass  # it has died already; its outcome reports that
        except BaseException:
            self.close()
            raise

    def fileno(self) -> int:
        """File descriptor that is readable when there is an answer, or the process has ended."""
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    def is_over(self) -> bool:
        """Read what is available, and return whether that was the end."""
        part = os.read(self.fileno(), _CHUNK)
        self._answer += part
        return not part

    def reply(self) -> str:
        """Line for `decode_outcome`, once it is over."""
        code = self._process.wait()
        if self._answer.endswith(b"\n"):
            return self._answer.decode("ascii")
        return encode_outcome(Lost(_ended(code, self._last_words())))

    def close(self) -> None:
        """Kill the process if it still runs, and remove its files."""
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
        how += ", as happens when memory runs out"
    return f"the process ended {how}" + (f": {last_words}" if last_words else "")
