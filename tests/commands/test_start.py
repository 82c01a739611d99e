"""What a start loads: nothing that it does not need."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest

import solidsph
from solidsph.cli import VERBS, cli

SLOW = {"h5py", "matplotlib", "numba", "numpy", "rich", "scipy"}


@pytest.mark.parametrize(
    "command", [["-c", "import solidsph"], ["-m", "solidsph", "--help"], ["-m", "solidsph", "rnu"]]
)
def test_a_start_loads_no_large_library(command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "importtime", *command], capture_output=True, text=True
    )
    # A line "import time: 12 | 34 | package.module" for each module.
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.split("\n")}
    assert "solidsph" in loaded
    assert not loaded & SLOW


def test_every_public_name_is_there() -> None:
    assert set(solidsph.__all__) <= set(dir(solidsph))
    for name in solidsph.__all__:
        assert getattr(solidsph, name) is not None
    with pytest.raises(AttributeError, match="Simulaton"):
        _ = solidsph.Simulaton  # type: ignore[attr-defined]


@pytest.mark.parametrize("verb", VERBS)
def test_the_list_of_verbs_says_what_each_says_itself(verb: str) -> None:
    command = cli.get_command(click.Context(cli), verb)
    assert command is not None
    assert command.get_short_help_str(limit=100) == VERBS[verb]
