"""Values that are kept for who asks again."""

from __future__ import annotations

from solidsph_builtin.shapes._recent_values import RecentValues


def test_the_values_made_last_are_kept() -> None:
    made: list[int] = []

    def value(key: int) -> int:
        return kept.value(key, lambda: made.append(key) or -key)

    kept: RecentValues[int] = RecentValues(2)
    assert [value(key) for key in (1, 2, 1, 2)] == [-1, -2, -1, -2]
    assert made == [1, 2]
    assert value(3) == -3  # 1 has to go
    assert [value(2), value(1)] == [-2, -1]
    assert made == [1, 2, 3, 1]
