"""Tables on a narrow terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from solidsph.commands import console
from solidsph.commands.console import Table

POINTS = Table(
    "points",
    ["configuration", "error [%]", "trusted [%]", "time [s]", "pair evaluations", "memory [MiB]"],
    [["spacing 0.02, gradient consistent, cover 2.6", 0.0020123, 0.31, 12.5, 63000000000, 97.195]],
)


def lines(table: Table, width: int, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    file = io.StringIO()
    monkeypatch.setattr(console, "out", Console(file=file, width=width, highlight=False))
    table.show()
    return file.getvalue().splitlines()


@pytest.mark.parametrize("width", [80, 100, 170])
def test_nothing_is_cut_off(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = lines(POINTS, width, monkeypatch)
    assert max(map(len, shown)) <= width
    text = "\n".join(shown)
    for number in ("0.0020123", "0.31", "12.5", "63000000000", "97.195"):
        assert number in text
    cells = " ".join(line.split("│")[1].strip() for line in shown if "│" in line)
    assert cells.split() == ["spacing", "0.02,", "gradient", "consistent,", "cover", "2.6"]
    assert "…" not in text


def test_headings_are_whole_where_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    assert any("pair evaluations" in line for line in lines(POINTS, 170, monkeypatch))
    assert not any("pair evaluations" in line for line in lines(POINTS, 80, monkeypatch))
