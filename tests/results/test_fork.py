"""A fork has none of the threads of compiled loops: there, they must not be waited for."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.helpers.waiting import HANG

# In a process of its own: what it starts must not be taken along into other tests. Threads are
# asked for from the first operation on, so that a small scene has them.
CODE = """
import multiprocessing as mp, os, sys
from concurrent.futures import ProcessPoolExecutor
from solidsph import SolidsphError
from solidsph.engines.compiled.fixed import partition
from tests.helpers.scenes import box
partition.WORTH_A_THREAD = 1
def built():
    return box(1, 12).initial(velocity={{"x": "X"}}).engine("compiled").outputs(1).build()
def told(simulation=None):
    try:
        (simulation or built()).run()
        return "ran"
    except SolidsphError as error:
        return "refused" if "'spawn'" in str(error) else str(error)
def tell(_):
    return told()
def tell_made(_):
    return told(MADE)
MADE = built()
{how}
"""

WAYS = {
    # name: (code, what it prints)
    "pool": ('with mp.get_context("fork").Pool(2) as p: print(p.map(tell, [1, 2]))', "refused"),
    "made before": ('with mp.get_context("fork").Pool(1) as p: print(p.map(tell_made, [1]))',
                    "refused"),
    "futures": ('with ProcessPoolExecutor(1, mp_context=mp.get_context("fork")) as p: '
                "print(p.submit(tell, 1).result())", "refused"),
    "os.fork": ("pid = os.fork()\nif not pid: print(told(), flush=True); os._exit(0)\n"
                "os.waitpid(pid, 0)", "refused"),
    "the parent": ("pid = os.fork()\nif not pid: os._exit(0)\nos.waitpid(pid, 0)\nprint(told())",
                   "ran"),
}  # fmt: skip


def in_a_child(code: str) -> subprocess.CompletedProcess[str]:
    """`code`, in a process of its own with two threads."""
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        check=False,
        timeout=HANG,
        env={**os.environ, "NUMBA_NUM_THREADS": "2", "PYTHONPATH": "."},
    )


@pytest.mark.parametrize(
    "way",
    ["os.fork", *(pytest.param(w, marks=pytest.mark.validation) for w in WAYS if w != "os.fork")],
)
def test_a_fork_says_so(way: str) -> None:
    how, expected = WAYS[way]
    code = CODE.format(how="MADE.run()\n" + how)
    child = in_a_child(code)
    assert expected in child.stdout, child.stderr
    assert "refused" in child.stdout or expected == "ran"


@pytest.mark.validation  # it compiles once more, in a process of its own
def test_a_fork_before_any_thread_runs() -> None:
    """The usual case: workers are started, then each runs scenes of its own."""
    code = CODE.replace("MADE = built()", "MADE = None").format(
        how='with mp.get_context("fork").Pool(1) as p: print(p.map(tell, [1]))'
    )
    child = in_a_child(code)
    assert "['ran']" in child.stdout, child.stderr
