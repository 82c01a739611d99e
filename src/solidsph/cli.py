"""The command line: `solidsph VERB`."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.metadata import version
from typing import Any, NoReturn, TextIO

import click

from solidsph.errors import BuildError, ConvergenceError, DivergedError, SolidsphError, UnsoundError

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


def _open_closed_streams() -> None:
    """Standard streams that the shell has closed lead nowhere.

    Else the next file that is opened, a record perhaps, would take the number of one of them.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115 -- open as long as the process


def _tell(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning as a user is told it; where it is not about the input, with path and source."""
    told = isinstance(message, UserWarning)
    text = f"warning: {message}\n"
    text = text if told else warnings.formatwarning(message, category, filename, lineno, line)
    print(text, end="", file=file or sys.stderr)


def main() -> None:
    """Run the command line; every error of the user's is one message, never a traceback."""
    _open_closed_streams()
    warnings.showwarning = _tell
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that cannot show a sign shows another
    if threading.current_thread() is threading.main_thread():
        # Whoever asks the process to end is heard like somebody at the keyboard.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    facts: dict[str, Any] = {}  # what a verb with --json has to tell, whatever the outcome
    try:
        code = cli.main(prog_name="solidsph", standalone_mode=False, obj=facts)
    except click.ClickException as cause:
        if not _as_json():
            cause.show()  # with the usage
            sys.exit(WRONG_INPUT)
        _end(WRONG_INPUT, "invalid input", f"error: {cause.format_message()}", facts)
    except (click.Abort, KeyboardInterrupt):
        _end(
            INTERRUPTED,
            "interrupted",
            "interrupted; what was recorded so far can be read, and gone on with: solidsph resume",
            facts,
        )
    except SolidsphError as cause:
        outcome = _FAILURES.get(type(cause))
        problems = cause.problems if isinstance(cause, BuildError) else [str(cause)]
        code = WRONG_INPUT if outcome is None else FAILED
        _end(code, outcome or "invalid input", f"error: {cause}", facts, problems)
    except OSError as cause:
        text = f"error: {cause}; check the path, its permissions and the disk"
        _end(WRONG_INPUT, "invalid input", text, facts)
    except Exception as cause:
        if os.environ.get(TRACEBACK) == "1":
            raise
        text = (
            f"error: {type(cause).__name__}: {cause}\nThis is a fault of solidsph or of a plugin, "
            f"not of the input; {TRACEBACK}=1 shows where it happened"
        )
        _end(FAILED, "failed", text, facts)
    sys.exit(code if isinstance(code, int) else 0)


# Errors of a run that was asked for rightly: how its outcome is called.
_FAILURES: Mapping[type[SolidsphError], str] = {
    ConvergenceError: "no equilibrium",
    DivergedError: "diverged",
    UnsoundError: "unsound",
}


def _as_json() -> bool:
    return "--json" in sys.argv[1:]


def _end(
    code: int, outcome: str, text: str, facts: Mapping[str, Any], problems: Sequence[str] = ()
) -> NoReturn:
    """Say what went wrong; with --json also as the one object on the standard output."""
    if _as_json():
        from solidsph.commands.console import show_json

        told = text.removeprefix("error: ")
        show_json(
            {
                **facts,
                "outcome": outcome,
                "exit code": code,
                "error": told,
                "problems": list(problems) or [told],
            }
        )
        sys.stdout.flush()
    print(text, file=sys.stderr)
    sys.exit(code)
