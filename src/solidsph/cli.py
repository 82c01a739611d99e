"""The command line: `solidsph VERB`."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import version
from typing import Any, NoReturn, TextIO

import click

from solidsph.errors import BuildError, ConvergenceError, DivergedError, SolidsphError, UnsoundError

LOG = logging.getLogger(__name__)

VERBS: Mapping[str, str] = {
    "run": "Run a scene or a case, and record it.",
    "resume": "Continue the run of a record.",
    "explain": "Show what a run would simulate and cost.",
    "cases": "List the cases with their parameters.",
    "plugins": "List the installed parts and where they come from.",
    "check": "Check a part, or certify a scheme.",
    "plot": "Draw a scene before it runs, or the pictures of a record or of all in a FOLDER.",
    "view": "Show a record in 3D, with sliders for time and deformation.",
    "reproduce": "Reproduce figures of the paper.",
    "cost": "Show the time that accuracy costs for a scene or a case.",
    "stability": "Run the hard cases, or draw a stability map.",
    "cache": "Show or clear the compiled functions on disk.",
}
"""Each verb and what it does, so that a list of them loads none."""

TRACEBACK = "SOLIDSPH_TRACEBACK"
"""Environment variable: if 1, an unexpected error shows its traceback."""

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130

# Errors of a valid run: its outcome in the JSON object.
_OUTCOMES: Mapping[type[SolidsphError], str] = {
    ConvergenceError: "no equilibrium",
    DivergedError: "diverged",
    UnsoundError: "unsound",
}

# What Click 8.2 and later raise where no verb is given; its message is the help.
_NO_ARGUMENTS: tuple[type[click.UsageError], ...] = tuple(
    kind for kind in [getattr(click.exceptions, "NoArgsIsHelpError", None)] if kind
)

_RECORDED = "; the outputs so far are readable, and solidsph resume continues the run"

_KEPT = "; finished points are kept, and the same command goes on from there"

_WHEN_INTERRUPTED: Mapping[str, str] = {"run": _RECORDED, "resume": _RECORDED, "cost": _KEPT}
"""What is left when a verb is interrupted, unless the interruption has a note of it."""


class _Verbs(click.Group):
    """Group that imports a verb's module only when that verb is needed."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        command: click.Command = getattr(import_module(f"solidsph.commands.{cmd_name}"), cmd_name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in VERBS and not args[0].startswith("-"):
            near = get_close_matches(args[0], VERBS, 1)
            ctx.fail(f"no such command {args[0]!r}{f'; did you mean {near[0]!r}?' if near else ''}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(VERBS.items()))


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("solidsph"), prog_name="solidsph")
@click.option("-v", "--verbose", "verbosity", count=True, help="As of every command: say more.")
@click.option("-q", "--quiet", is_flag=True, help="As of every command: results and errors only.")
def cli(verbosity: int, quiet: bool) -> None:
    """Smoothed Particle Hydrodynamics for nonlinear solid mechanics.

    Exit codes: 0 success, 1 the run or the check failed, 2 invalid input, 130 interrupted.
    """


def main() -> None:
    """Run the command line. Errors of the user end in one message, without a traceback."""
    _redirect_closed_streams()
    warnings.showwarning = _show_warning
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # for terminals that lack a character
    if threading.current_thread() is threading.main_thread():
        # A request to terminate is handled like Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    facts: dict[str, Any] = {}  # filled by a verb with --json, printed whatever the outcome
    try:
        code = cli.main(prog_name="solidsph", standalone_mode=False, obj=facts)
    except _NO_ARGUMENTS as cause:
        cause.show()
        sys.exit(WRONG_INPUT)
    except click.ClickException as cause:
        _end(WRONG_INPUT, "invalid input", f"error: {_usage(cause)}", facts)
    except (click.Abort, KeyboardInterrupt) as cause:
        (kept, *_) = [*_notes(cause), _WHEN_INTERRUPTED.get(_verb(), "")]
        text = f"interrupted{kept}"
        _end(INTERRUPTED, "interrupted", text, facts)
    except SolidsphError as cause:
        outcome = _OUTCOMES.get(type(cause))
        problems = cause.problems if isinstance(cause, BuildError) else [str(cause)]
        code = WRONG_INPUT if outcome is None else FAILED
        _end(code, outcome or "invalid input", f"error: {cause}", facts, problems)
    except OSError as cause:
        where = f"{cause.filename}: " if cause.filename else ""
        what = f"{where}{cause.strerror or cause}"
        text = f"error: {what}; check the path, its permissions and the disk"
        _end(WRONG_INPUT, "invalid input", text, facts)
    except Exception as cause:
        if os.environ.get(TRACEBACK) == "1":
            raise
        text = (
            f"error: {type(cause).__name__}: {cause}\nThis is a bug in solidsph or in a plugin, "
            f"not in the input; set {TRACEBACK}=1 to see where it occurred"
        )
        _end(FAILED, "failed", text, facts)
    sys.exit(code if isinstance(code, int) else 0)


def _usage(cause: click.ClickException) -> str:
    """What is wrong with how a verb was called, in one line, and where to read on."""
    text = " ".join(cause.format_message().split()).rstrip(".")
    return f"{text[:1].lower()}{text[1:]}; see: {f'solidsph {_verb()}'.strip()} --help"


def _redirect_closed_streams() -> None:
    """Connect standard streams that the shell has closed to the null device.

    Otherwise the next file opened, such as a record, would take the number of one of them.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115 -- open as long as the process


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Log a warning about the input in one line, any other with its path and source."""
    text = str(message)
    if not isinstance(message, UserWarning):
        text = warnings.formatwarning(message, category, filename, lineno, line).rstrip()
    LOG.warning(text)


def _as_json() -> bool:
    return "--json" in sys.argv[1:]


def _notes(cause: BaseException) -> Sequence[str]:
    """Notes of an interruption, which click wraps."""
    notes: Sequence[str] = getattr(cause.__cause__ or cause, "__notes__", ())
    return notes


def _verb() -> str:
    """The verb of this command, empty if there is none."""
    return next((word for word in sys.argv[1:] if word in VERBS), "")


def _end(
    code: int, outcome: str, text: str, facts: Mapping[str, Any], problems: Sequence[str] = ()
) -> NoReturn:
    """Print an error and exit; with --json the standard output gets one object besides."""
    if _as_json():
        from solidsph.commands.console import show_json

        message = text.removeprefix("error: ")
        failure = {"outcome": outcome, "exit code": code, "error": message}
        show_json({**facts, **failure, "problems": list(problems) or [message]})
    print(text, file=sys.stderr)
    sys.exit(code)
