"""The user's cache: whole entries or none, within a bound, whoever writes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from solidsph.system.cache import CACHE, Store, cache_folder, write_whole


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setenv(CACHE, str(tmp_path / "cache"))
    return Store("things", 1000)


def test_an_entry_is_read_as_it_was_written(store: Store) -> None:
    assert store.read("a") is None
    assert store.entries == []
    store.write("a", b"abc")
    assert store.read("a") == b"abc"
    assert [path.name for path, _ in store.entries] == ["a"]
    store.clear()
    assert store.read("a") is None


def test_a_damaged_entry_counts_as_missing(store: Store) -> None:
    store.write("a", b"abc" * 20)
    path = store.folder / "a"
    whole = path.read_bytes()
    for broken in (b"", whole[:10], whole[:-1], whole + b"x", whole[:-1] + b"x"):
        path.write_bytes(broken)
        assert store.read("a") is None, broken
    store.write("a", b"new")
    assert store.read("a") == b"new"


def test_what_was_not_used_for_longest_goes_first(store: Store) -> None:
    for k, key in enumerate("abcde"):
        store.write(key, bytes(150))  # and 32 of the digest: five fit
        os.utime(store.folder / key, (k, k))
    store.read("a")
    store.write("f", bytes(150))
    assert {path.name for path, _ in store.entries} == set("acdef")
    assert sum(size for _, size in store.entries) <= store.largest


def test_small_entries_stay_within_the_bound_without_a_look_at_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CACHE, str(tmp_path))
    store, looks = Store("many", 100_000), 0
    listed = Path.iterdir

    def counted(folder: Path) -> Iterator[Path]:
        nonlocal looks
        looks += 1
        return listed(folder)

    monkeypatch.setattr(Path, "iterdir", counted)
    for key in range(2600):
        store.write(str(key), bytes(18))  # and 32 of the digest: a two thousandth of the bound
    # One in twenty looks, and 2000 entries fit. Chance leaves neither limit once in 10^9 tests.
    assert looks < 260
    assert sum(size for _, size in store.entries) < 1.25 * store.largest


def test_several_writers_leave_one_whole_entry(store: Store) -> None:
    contents = [bytes([k]) * 100 for k in range(8)]
    with ThreadPoolExecutor(8) as pool:
        for content in pool.map(lambda one: store.write("a", one) or store.read("a"), contents * 8):
            assert content in contents
    assert [path.name for path, _ in store.entries] == ["a"]


def test_nothing_fails_where_nothing_can_be_written(store: Store) -> None:
    cache_folder().write_text("a file where the folder would be")
    store.write("a", b"abc")
    assert store.read("a") is None
    assert store.entries == []
    store.clear()
    write_whole(store.folder / "b", b"")


def test_where_the_cache_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE, "/own")
    assert cache_folder() == Path("/own")
    monkeypatch.delenv(CACHE)
    monkeypatch.setenv("XDG_CACHE_HOME", "/elsewhere")
    assert cache_folder() == Path("/elsewhere/solidsph")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "solidsph"
