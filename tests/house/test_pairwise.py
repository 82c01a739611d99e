"""What `make test` leaves to `make validate` of a product of arguments."""

from __future__ import annotations

from itertools import combinations, product

from tests.helpers.pairwise import pairwise

ARGUMENTS = (("a", "b", "c"), (1, 2), ("x", "y", "z", "w"), (True, False))


def test_every_combination_is_there_and_any_two_values_meet_in_a_quick_one() -> None:
    every = pairwise(*ARGUMENTS)
    assert [one.values for one in every] == list(product(*ARGUMENTS))
    quick = [one.values for one in every if not one.marks]
    pairs = [set(combinations(enumerate(values), 2)) for values in quick]
    wanted = {pair for one in every for pair in combinations(enumerate(one.values), 2)}
    assert set().union(*pairs) == wanted
    # 3 x 4 of the two longest are needed at least, of 48.
    assert 12 <= len(quick) <= 16
