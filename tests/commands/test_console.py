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


CROWDED = Table(
    "measurements",
    ["quantity", "measured", "reference", "unit", "error", "verdict", "as expected"],
    [
        [
            "largest relative change of angular momentum",
            6.6613e-16,
            0.0,
            "1",
            6.6613e-16,
            None,
            True,
        ],
        ["smallest distance of neighbours", 0.95618, None, "spacings", None, "apart", False],
    ],
)


@pytest.mark.parametrize("table", [POINTS, CROWDED])
def test_every_column_is_there_at_80(table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    _, top, *shown = lines(table, 80, monkeypatch)
    assert max(map(len, shown)) <= 80
    assert top[-1] == "┓"
    heading = [line[1:-1].split("┃") for line in shown if line.startswith("┃")]
    assert [" ".join(words).split() for words in zip(*heading, strict=True)] == [
        name.split() for name in table.columns
    ]
    body = [line for line in shown if line.startswith("│")]
    assert all(line.endswith("│") for line in body)
    cells = [" ".join(column).split() for column in zip(*(x.split("│") for x in body), strict=True)]
    assert cells[-2][-1] == console._text(table.rows[-1][-1])


def test_a_column_of_numbers_may_have_gaps(monkeypatch: pytest.MonkeyPatch) -> None:
    table = Table("gaps", ["number", "none"], [[1.5, None], [None, None], ["", ""]])
    shown = lines(table, 80, monkeypatch)
    assert "│    1.5 │      │" in shown  # right-aligned
