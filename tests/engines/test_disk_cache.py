"""Compiled functions on disk: the next process compiles nothing, and computes the same bits."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from solidsph.system.cache import CACHE

ROOT = Path(__file__).parents[2]

COUNTED = """
import numba.core.event as event

class Count(event.Listener):
    compiled = 0
    def on_start(self, what): self.compiled += 1
    def on_end(self, what): pass

count = Count()
event.register("numba:compile", count)
"""

LAW = (
    COUNTED
    + """
import sys
from numba import types
from solidsph.engines.compiled.pointwise import compiled_function
import law

for argument in sys.argv[1:]:
    function = compiled_function(law.times(float(argument)), types.float64)
    print(function(1.0), count.compiled)
    count.compiled = 0
"""
)

SOURCE = """
def shift(x):
    return x + 1.0

def times(factor):
    def law(x):
        return factor * shift(x)
    return law
"""


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(CACHE, str(folder))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # an edit within a second must be seen
    return folder


def printed(program: str, *arguments: str) -> list[list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def test_only_what_has_changed_is_compiled(
    tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "law.py").write_text(SOURCE)
    ((value, first),) = printed(LAW, "2")
    assert (value, int(first) > 0) == ("4.0", True)
    # Another closure of the same name is another function, and meets the first in one process.
    assert printed(LAW, "3", "2") == [["6.0", first], ["4.0", "0"]]
    assert printed(LAW, "2", "3") == [["4.0", "0"], ["6.0", "0"]]
    # A helper that it calls has changed.
    (tmp_path / "law.py").write_text(SOURCE.replace("1.0", "2.0"))
    (two, again), (three, closure) = printed(LAW, "2", "3")
    assert (two, again, three) == ("6.0", first, "9.0")
    assert int(closure) > 0
    # A setting of the compiler makes other code.
    monkeypatch.setenv("NUMBA_OPT", "1")
    assert printed(LAW, "2") == [["6.0", first]]


@pytest.mark.validation
def test_damaged_entries_are_compiled_anew(tmp_path: Path, own_cache: Path) -> None:
    (tmp_path / "law.py").write_text(SOURCE)
    ((_, first),) = printed(LAW, "2")
    entries = list((own_cache / "compiled").iterdir())
    assert entries
    for path in entries:
        path.write_bytes(path.read_bytes()[:-100])
    assert printed(LAW, "2") == [["4.0", first]]
    assert printed(LAW, "2") == [["4.0", "0"]]


def test_numbers_of_functions_differ_between_processes() -> None:
    """Or the linker would take functions of equal names for the same."""
    first, second = (int(printed(IDS)[0][0]) for _ in range(2))
    assert abs(first - second) > 10**6


IDS = """
import solidsph.engines.compiled.jit
from numba.core.bytecode import FunctionIdentity
print(next(FunctionIdentity._unique_ids))
"""

RUN = (
    COUNTED
    + """
import hashlib
from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.count import count_work
from solidsph.costs.model import predict
from solidsph.engines.compiled.fixed import partition
from tests.helpers.scenes import box

partition.WORTH_A_THREAD = 1
simulation = box(1, 12).initial(velocity={"x": "X"}).engine("compiled").outputs(1).build()
end = simulation.run().state
work = count_work(simulation)
known = all(one.on_disk for one in work.compilations)
compiling = predict(work, REFERENCE).compiling
print(count.compiled, known, compiling, hashlib.sha256(end.positions.tobytes()).hexdigest())
"""
)


@pytest.mark.parametrize("threads", ["1", pytest.param("2", marks=pytest.mark.validation)])
def test_a_second_run_compiles_nothing_and_moves_the_same(
    threads: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a cache that other tests may have filled."""
    monkeypatch.setenv("NUMBA_NUM_THREADS", threads)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    (_, _, _, moved), (compiled, known, compiling, same) = (printed(RUN)[0] for _ in range(2))
    assert compiled == "0"
    assert same == moved
    # The prediction knows that all of it is on disk: to read takes a hundredth.
    assert known == "True"
    assert float(compiling) < 0.2


CLOCKED = """
import time
from solidsph.engines.compiled.jit import njit
from solidsph.system.compile_time import COMPILE_TIME

@njit
def inner(x):
    return x + 1.0

@njit
def outer(x):
    return inner(x) * 2.0

begun = time.perf_counter()
outer(1.0)
print(COMPILE_TIME.seconds, time.perf_counter() - begun)
"""


def test_time_of_compiling_is_counted_once_though_functions_are_compiled_within_others(
    own_cache: Path, tmp_path: Path
) -> None:
    script = tmp_path / "clocked.py"
    script.write_text(CLOCKED)

    def run() -> tuple[float, float]:
        line = subprocess.run(
            [sys.executable, str(script)], capture_output=True, check=True, text=True
        ).stdout
        compiling, whole = map(float, line.split())
        return compiling, whole

    compiling, whole = run()
    assert 0.5 * whole < compiling < whole
    assert run()[0] == 0.0
