"""An effect that a scene does not name might as well not be installed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from solidsph.registry import registry
from tests.helpers.absent_effects import BUSY, LEAKS

ROOT = Path(__file__).parents[2]

EFFECTS = tuple(registry.names("effects"))
OTHERS = tuple(name for name in EFFECTS if name not in BUSY)

Question = tuple[Sequence[str], str | None, str]  # effects that are gone, leak, engine


def answers(questions: Sequence[Question]) -> list[dict[str, Any]]:
    """Each from a process that begins like the others (`tests.helpers.absent_effects`)."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.helpers.absent_effects"],
        input=json.dumps(questions),
        capture_output=True,
        text=True,
        cwd=ROOT,
        # The same order of every set, and one thread, which a fork takes along.
        env={**os.environ, "PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@cache
def measured() -> dict[tuple[str, ...], dict[str, Any]]:
    """What is measured where some effects are not installed."""
    gone: list[tuple[str, ...]] = [(), EFFECTS, OTHERS]
    return dict(zip(gone, answers([(some, None, "matrix") for some in gone]), strict=True))


@cache
def by_leak() -> dict[str, set[str]]:
    """What differs for an effect that nobody names, by how the core leaks."""
    found = answers([(gone, leak, "matrix") for leak in LEAKS for gone in ((), EFFECTS[-1:])])
    pairs = zip(found[::2], found[1::2], strict=True)
    return {leak: differences(*pair) for leak, pair in zip(LEAKS, pairs, strict=True)}


def differences(here: dict[str, Any], gone: dict[str, Any]) -> set[str]:
    """What is not the same in all scenes that both have run."""
    return {
        what
        for scene in here.keys() & gone.keys()
        for what in here[scene]
        if here[scene][what] != gone[scene][what]
    }


@pytest.mark.parametrize(("gone", "scene"), [(EFFECTS, "bare"), (OTHERS, "busy")])
def test_a_scene_is_as_if_what_it_does_not_name_did_not_exist(
    gone: tuple[str, ...], scene: str
) -> None:
    here, without = measured()[()], measured()[gone]
    assert scene in without
    assert differences(here, without) == set()
    assert here["bare"]["instructions"] > 1000  # something was counted


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_scene_without_it_does_not_import_it(effect: str) -> None:
    here = measured()[()]
    module = registry.find("effects", effect).target.partition(":")[0]
    assert module not in here["bare"]["modules"]
    if effect not in BUSY:
        assert module not in here["busy"]["modules"]


def test_what_a_scene_does_name_shows() -> None:
    """The measures do tell an effect that is there from one that is not."""
    bare, busy = (measured()[()][scene] for scene in ("bare", "busy"))
    assert {what for what in bare if bare[what] != busy[what]} >= {
        "results",
        "bytes of arrays",
        "modules",
        "instructions",
    }


@pytest.mark.parametrize(
    ("leak", "shows"),
    [
        ("import", "modules"),
        ("branch", "instructions"),
        ("array", "bytes of arrays"),
        ("result", "results"),
    ],
)
def test_a_core_that_leaks_is_found_out(leak: str, shows: str) -> None:
    """What a careless core might do for an effect that nobody has named."""
    assert shows in by_leak()[leak]


@pytest.mark.validation
def test_the_compiled_loop_has_no_code_for_any_of_them() -> None:
    """As many lines of code, and no load: the chain of loads is unrolled as it compiles."""
    here, gone = answers([((), None, "compiled"), (EFFECTS, None, "compiled")])
    assert differences(here, gone) == set()
    assert here["bare"]["loads"] == 1  # the traction
    assert here["bare"]["lines of code"] > 1000
