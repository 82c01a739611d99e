"""The command line: `solidsph VERB`."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import version

import click

from solidsph.errors import DivergedError, SolidsphError

VERBS = ("run", "explain", "cases", "plugins", "check", "plot")

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

    Exit codes: 0 all is well, 1 the run or the check failed, 2 the input is wrong.
    """


def main() -> None:
    """Run the command line; every error of the user's is one message, never a traceback."""
    try:
        code = cli.main(prog_name="solidsph", standalone_mode=False)
    except click.ClickException as cause:
        cause.show()
        sys.exit(WRONG_INPUT)
    except (click.Abort, KeyboardInterrupt):
        print("interrupted; what was recorded so far can be read", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except SolidsphError as cause:
        print(f"error: {cause}", file=sys.stderr)
        sys.exit(FAILED if isinstance(cause, DivergedError) else WRONG_INPUT)
    sys.exit(code if isinstance(code, int) else 0)
