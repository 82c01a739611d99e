"""Shared by all tests."""

from __future__ import annotations

import functools
import os
import signal
import sys
import textwrap
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoints, entry_points
from pathlib import Path

import pytest
from hypothesis import HealthCheck, is_hypothesis_test, settings

from solidsph.costs import calibration
from solidsph.costs.coefficients import REFERENCE
from solidsph.registry import registry
from solidsph.system.cache import CACHE, write_whole
from solidsph.system.cache import cache_folder as users_cache
from tests.helpers.examples import QUICK, THOROUGH
from tests.slow import SLOW

# Machines that run the tests are shared: a slow moment is not a failure. Examples stay random, so
# that every run looks elsewhere; what fails is printed in a form that repeats it.
for profile, share in (("quick", QUICK), ("thorough", THOROUGH)):
    settings.register_profile(
        profile,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],
        print_blob=True,
        max_examples=share,
    )
settings.load_profile("quick")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark what Hypothesis gives examples to: `make validate` tries more of them."""
    if is_hypothesis_test(getattr(item, "obj", None)):
        item.add_marker(pytest.mark.examples)


# A shell has what it starts in the background ignore interrupts, and so what the tests start, which
# are to be interrupted.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# The width of tables in what tests read is not that of the terminal, which pytest-xdist hands on.
os.environ.pop("COLUMNS", None)


# Rooms whose files take longest.
LONG = ("bare", "engines", "results", "studies", "testing", "cases")


@pytest.hookimpl(tryfirst=True)  # before what is not asked for by its mark is left out
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what is slow; the longest files first, so that neither of two processes ends long after
    the other."""
    files = {item.nodeid.partition("::")[0] for item in items}
    single = any("::" in argument for argument in config.args)  # some tests of a file only
    for slow in SLOW:
        found = [item for item in items if item.nodeid.startswith(slow)]
        for item in found:
            item.add_marker(pytest.mark.validation)
        if not found and not single and slow.partition("::")[0] in files:
            raise pytest.UsageError(f"tests/slow.py names {slow!r}, which is no test any more")
    items.sort(key=lambda item: item.path.parent.name not in LONG)


@pytest.fixture(scope="session")
def cache_folder() -> Path:
    """What the user's cache would hold, of this session and all others, in whichever clone.

    To compile what the tests run takes longer than to run it, and an entry is known by its content.
    The calibration in it is the reference: no test measures this machine unless it says so.
    """
    folder = users_cache() / "tests"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CACHE, str(folder))
        write_whole(calibration.cache_file(), REFERENCE.to_json().encode())
    return folder


@functools.cache
def _installed(path: tuple[str, ...], group: str) -> EntryPoints:
    return entry_points(group=group)


@pytest.fixture(autouse=True, scope="session")
def _listed_once() -> Iterator[None]:
    """What is installed is read once: to read it for every part is most of a small build."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "entry_points", lambda group: _installed(tuple(sys.path), group))
        yield


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch, cache_folder: Path) -> None:
    """No test sees a restriction of plugins that the caller's shell may hold, or its cache."""
    for name in [name for name in os.environ if name.startswith("SOLIDSPH_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv(CACHE, str(cache_folder))


@pytest.fixture
def foreign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str, str, str, str], None]]:
    """Installs distributions of one module each, into folders of their own on the path."""
    installed: list[str] = []

    def install(distribution: str, module: str, source: str, points: str) -> None:
        folder = tmp_path / distribution
        info = folder / f"{distribution.replace('-', '_')}-1.2.dist-info"
        info.mkdir(parents=True)
        (folder / f"{module}.py").write_text(textwrap.dedent(source))
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n"
        )
        (info / "entry_points.txt").write_text(textwrap.dedent(points))
        monkeypatch.syspath_prepend(str(folder))
        installed.append(module)

    yield install
    for name in installed:
        sys.modules.pop(name, None)
