"""Every exception survives the way to another process, with all that it says and holds."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from operator import methodcaller

import numpy as np
import pytest

import solidsph
import solidsph_builtin
from solidsph import BuildError, ConvergenceError, DivergedError, SolidsphError
from solidsph.errors import PortableError
from solidsph.interfaces.time_loop import StepError
from solidsph.statics.factors import SingularError
from tests.helpers.scenes import box


def exceptions() -> list[type[BaseException]]:
    """All that the packages define."""
    found: dict[type[BaseException], None] = {}
    for package in (solidsph, solidsph_builtin):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if info.name.endswith("__main__"):
                continue
            module = importlib.import_module(info.name)
            for one in vars(module).values():
                own = isinstance(one, type) and issubclass(one, BaseException)
                if own and one.__module__.split(".")[0] == package.__name__:
                    found[one] = None
    return list(found)


# How the ones are made that take more than a message. A new kind needs a line here.
MADE = {
    "BuildError": lambda kind: kind(["this", "that"]),
    "DivergedError": lambda kind: kind(
        step=3, time=0.1, particle=7, volume_ratio=-0.5, cause="it broke"
    ),
    "ConvergenceError": lambda kind: kind(
        load_factor=0.5,
        tried=0.6,
        residual=0.1,
        particle=7,
        volume_ratio=0.9,
        cause="no descent",
        remedy="smaller steps",
    ),
    "UnsolvedError": lambda kind: kind(0.1, 5000),
    "SingularError": lambda kind: kind(3),
    "LoadStepError": lambda kind: kind("cause", "remedy", np.arange(3.0)),
    "UnsoundError": lambda kind: kind(
        time=0.1, part=0.3, tolerance=0.01, cause="the step", remedy="a smaller one"
    ),
    "StepError": lambda kind: kind(None, "not finite"),
}


def assert_same(one: BaseException, other: BaseException) -> None:
    assert type(other) is type(one)
    assert str(other) == str(one)
    assert other.args == one.args
    assert vars(other).keys() == vars(one).keys()
    for name, value in vars(one).items():
        np.testing.assert_equal(vars(other)[name], value)


@pytest.mark.parametrize("kind", exceptions(), ids=lambda kind: kind.__name__)
def test_every_exception_survives_pickling(kind: type[BaseException]) -> None:
    error = MADE.get(kind.__name__, lambda kind: kind("what was wrong"))(kind)
    error.add_note("in the third scene")
    error.__cause__ = ValueError("of a library")
    restored = pickle.loads(pickle.dumps(error))
    assert_same(error, restored)
    assert restored.__notes__ == ["in the third scene"]
    assert isinstance(restored.__cause__, ValueError)
    assert_same(restored, pickle.loads(pickle.dumps(restored)))


def test_the_walk_finds_them() -> None:
    found = exceptions()
    assert {BuildError, DivergedError, ConvergenceError, SingularError, StepError} <= set(found)
    assert all(issubclass(kind, PortableError) for kind in found)


class OddError(SolidsphError):
    """As somebody else may write one: it takes what it does not hand on."""

    def __init__(self, *, where: str) -> None:
        self.where = where
        super().__init__(f"odd at {where}")


class UnreadableError(Exception):
    """One of a library that is written, and cannot be read again."""

    def __init__(self, one: int, two: int) -> None:
        super().__init__("two numbers")


def test_others_errors_and_causes_survive_too() -> None:
    error = OddError(where="left")
    error.__cause__ = UnreadableError(1, 2)
    restored = pickle.loads(pickle.dumps(error))
    assert_same(error, restored)
    # As itself where a library, such as one of clusters, has taught pickle to read all exceptions.
    said = type(restored.__cause__).__name__, str(restored.__cause__)
    assert said in (
        ("RuntimeError", "UnreadableError: two numbers"),
        ("UnreadableError", "two numbers"),
    )


def test_the_problems_of_a_build_come_back_from_a_process() -> None:
    builder = box(1).boundary("clamp", where="nowhere").boundary("clamp", where="neither")
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool,
        pytest.raises(BuildError, match="2 problems") as caught,
    ):
        pool.submit(methodcaller("build"), builder).result()
    assert len(caught.value.problems) == 2
    assert "nowhere" in caught.value.problems[0]
