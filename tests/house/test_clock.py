"""No test asks the clock: none fails because a machine is slow or busy.

Every file of tests is read for what asks it. What may is named below, with the reason.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.helpers.waiting import HANG, wait_for

ROOT = Path(__file__).parents[2]
FILES = [*ROOT.glob("tests/**/*.py"), *ROOT.glob("plugins/examples/*/tests/*.py")]

ALLOWED = {
    ("waiting.py", "time.monotonic"): "only ends a test that hangs",
    ("waiting.py", "time.sleep"): "between two looks at what is waited for",
    ("resuming.py", "time.monotonic"): "where a run is when it is killed; any place will do",
    ("resuming.py", "time.sleep"): "between two looks at what is waited for",
    ("sweeping.py", "time.sleep"): "a task that does not end by itself",
    ("test_record.py", "time.time"): "waits for the second of the clock to change",
    ("test_record.py", "time.sleep"): "where a writer is when it is killed; any place will do",
    ("test_sweep.py", "time.time"): "file times, for a clock that the test holds still",
    ("test_sweep.py", "time.sleep"): "where a sweep is when it is killed; any place will do",
    (
        "test_sweep.py",
        "patience = 1.0",
    ): "nobody listens there, however long one waits",
    ("study.py", "time.perf_counter"): "seconds for a table; nothing is asserted of them",
    ("fuzzing.py", "signal.setitimer"): "only ends what hangs, after HANG",
}
"""By file and what it does: why it may."""

CLOCKS = {
    *("time.time", "time.monotonic", "time.perf_counter", "time.process_time", "time.sleep"),
    *("time.time_ns", "time.monotonic_ns", "time.perf_counter_ns", "time.process_time_ns"),
    *("time.thread_time", "asyncio.sleep", "resource.getrusage", "os.times", "datetime.now"),
    *("signal.setitimer", "signal.alarm"),
}
LIMITS = {"timeout", "patience", "deadline"}
WAITING = {"wait", "join", "communicate", "result", "acquire", "WebDriverWait"}
TIMES = {"seconds", "elapsed", "took", "duration_s", "wall_time", "time_taken"}


def askings(tree: ast.AST) -> Iterator[str]:
    """What in a file of tests asks the clock."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "time":
            yield "from time import"
        if isinstance(node, ast.Attribute) and ast.unparse(node) in CLOCKS:
            yield ast.unparse(node)
        if isinstance(node, ast.Call):
            yield from _limits(node)
        if isinstance(node, ast.Assert):
            yield from _comparisons(node)


def _limits(call: ast.Call) -> Iterator[str]:
    for word in call.keywords:
        if word.arg in LIMITS and ast.unparse(word.value) not in ("HANG", "None"):
            yield f"{word.arg} = {ast.unparse(word.value)}"
    name = ast.unparse(call.func).rpartition(".")[2]
    numbers = [one for one in call.args if isinstance(one, ast.Constant)]
    if name in WAITING and any(type(one.value) in (int, float) for one in numbers):
        yield f"{name}({', '.join(map(ast.unparse, call.args))})"
    suppressed = [word.value for word in call.keywords if word.arg == "suppress_health_check"]
    if name == "settings" and suppressed and "too_slow" not in ast.unparse(suppressed[0]):
        yield "settings that fail where examples come slowly"


def _comparisons(statement: ast.Assert) -> Iterator[str]:
    for node in ast.walk(statement.test):
        if isinstance(node, ast.Compare):
            ordered = any(isinstance(one, (ast.Lt, ast.LtE, ast.Gt, ast.GtE)) for one in node.ops)
            for side in (node.left, *node.comparators):
                name = side.attr if isinstance(side, ast.Attribute) else ast.unparse(side)
                if ordered and name in TIMES:
                    yield f"compares {name}"


def found() -> set[tuple[str, str]]:
    """In all files of tests, by file."""
    return {
        (file.name, asking)
        for file in FILES
        for asking in askings(ast.parse(file.read_text(encoding="utf-8")))
    }


def test_no_test_asks_the_clock() -> None:
    unexpected = sorted(found() - set(ALLOWED))
    assert unexpected == [], (
        "these ask the clock: assert counts, bytes or order instead, wait for events "
        "(tests/helpers/waiting.py), or measure in benchmarks/"
    )


def test_what_is_allowed_is_there() -> None:
    assert set(ALLOWED) - found() == set()


@pytest.mark.parametrize(
    ("code", "asked"),
    [
        ("begun = time.perf_counter()", ["time.perf_counter"]),
        ("from time import monotonic", ["from time import"]),
        ("assert run.seconds < 2.0", ["compares seconds"]),
        ("assert 0.0 < took < limit", ["compares took"]),
        ("assert run.seconds == 1.0", []),
        ("subprocess.run(words, timeout=60)", ["timeout = 60"]),
        ("subprocess.run(words, timeout=HANG)", []),
        ("process.communicate(timeout=60)", ["timeout = 60"]),
        ("thread.join(5.0)", ["join(5.0)"]),
        ("', '.join(words)", []),
        ("WebDriverWait(browser, 20)", ["WebDriverWait(browser, 20)"]),
        ("settings(max_examples=3, deadline=200)", ["deadline = 200"]),
        (
            "settings(suppress_health_check=[HealthCheck.data_too_large])",
            ["settings that fail where examples come slowly"],
        ),
        ("used = resource.getrusage(who)", ["resource.getrusage"]),
    ],
)
def test_what_asks_the_clock_is_seen(code: str, asked: list[str]) -> None:
    assert list(askings(ast.parse(code))) == asked


def test_examples_may_take_their_time() -> None:
    default = settings.default
    assert default is not None
    assert default.deadline is None
    assert HealthCheck.too_slow in default.suppress_health_check


def test_only_minutes_end_what_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    assert HANG >= 600.0
    monkeypatch.setattr("tests.helpers.waiting.HANG", -1.0)
    with pytest.raises(TimeoutError, match="the test hangs"):
        wait_for(lambda: False)
    wait_for(lambda: True)
