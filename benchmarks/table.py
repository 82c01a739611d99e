"""Table: rows of words under a title, for a terminal and for a page."""

from __future__ import annotations

import attrs


@attrs.frozen
class Table:
    """Rows of words; the first column stands left, numbers stand right."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    def text(self) -> str:
        """As a terminal shows it."""
        lines = [self.columns, *self.rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        body = ["  " + "  ".join(map(_placed, line, widths, self._sides())) for line in lines]
        return "\n".join([self.title, *body, *([f"  {self.note}"] if self.note else [])])

    def markdown(self) -> str:
        """As a page shows it."""
        rule = ["---" if left else "---:" for left in self._sides()]
        lines = [self.columns, tuple(rule), *self.rows]
        body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        return f"## {self.title}\n\n{body}\n" + (f"\n{self.note}\n" if self.note else "")

    def _sides(self) -> list[bool]:
        """Which columns stand left: those that hold a word that is no number."""
        return [any(_is_word(cell) for cell in column) for column in zip(*self.rows, strict=True)]


def _placed(word: str, width: int, left: bool) -> str:
    return word.ljust(width) if left else word.rjust(width)


def _is_word(cell: str) -> bool:
    return bool(cell) and not any(sign.isdigit() for sign in cell[:2])
