"""Fewer combinations at every change, all of them by `make validate`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import pytest


def pairwise(*argument_values: Sequence[Any]) -> list[Any]:
    """Every combination of the values, for `pytest.mark.parametrize`.

    Those that `make test` can do without bear the mark `validation`: any two values of different
    arguments meet in one that does not.
    """
    every = list(product(*(range(len(values)) for values in argument_values)))
    missing = {pair for chosen in every for pair in _pairs(chosen)}
    quick = set()
    while missing:
        best = max(every, key=lambda chosen: len(missing.intersection(_pairs(chosen))))
        quick.add(best)
        missing.difference_update(_pairs(best))
    return [
        pytest.param(
            *(values[k] for values, k in zip(argument_values, chosen, strict=True)),
            marks=() if chosen in quick else pytest.mark.validation,
        )
        for chosen in every
    ]


def _pairs(chosen: tuple[int, ...]) -> set[Any]:
    return set(combinations(enumerate(chosen), 2))
