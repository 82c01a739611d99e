"""The command line: `solidsph VERB`."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from importlib import import_module
from importlib.metadata import version

import click

from solidsph.errors import ConvergenceError, DivergedError, SolidsphError, UnsoundError

VERBS = (
    *("run", "resume", "explain", "cases", "plugins", "check", "plot"),
    *("reproduce", "cost", "stability"),
)

TRACEBACK = "SOLIDSPH_TRACEBACK"
"""Environment variable: if 1, an unexpected error shows its traceback."""

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130


class _Verbs(click.Group):
    """Loads a verb's module only when that verb, or the list of all, is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        command: click.Command = getattr(import_module(f"solidsph.commands.{cmd_name}"), cmd_name)
        return command


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("solidsph"), prog_name="solidsph")
def cli() -> None:
    """Smoothed Particle Hydrodynamics for nonlinear solid mechanics.

    Exit codes: 0 all is well, 1 the run or the check failed, 2 the input is wrong, 130 interrupted.
    """


def main() -> None:
    """Run the command line; every error of the user's is one message, never a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that cannot show a sign shows another
    if threading.current_thread() is threading.main_thread():
        # Whoever asks the process to end is heard like somebody at the keyboard.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        code = cli.main(prog_name="solidsph", standalone_mode=False)
    except click.ClickException as cause:
        cause.show()
        sys.exit(WRONG_INPUT)
    except (click.Abort, KeyboardInterrupt):
        print(
            "interrupted; what was recorded so far can be read, and gone on with: solidsph resume",
            file=sys.stderr,
        )
        sys.exit(INTERRUPTED)
    except SolidsphError as cause:
        print(f"error: {cause}", file=sys.stderr)
        failed = isinstance(cause, (ConvergenceError, DivergedError, UnsoundError))
        sys.exit(FAILED if failed else WRONG_INPUT)
    except OSError as cause:
        print(f"error: {cause}; check the path, its permissions and the disk", file=sys.stderr)
        sys.exit(WRONG_INPUT)
    except Exception as cause:
        if os.environ.get(TRACEBACK) == "1":
            raise
        print(
            f"error: {type(cause).__name__}: {cause}\nThis is a fault of solidsph or of a plugin, "
            f"not of the input; {TRACEBACK}=1 shows where it happened",
            file=sys.stderr,
        )
        sys.exit(FAILED)
    sys.exit(code if isinstance(code, int) else 0)
