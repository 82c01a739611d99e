"""Limits and error bars by refinement."""

from __future__ import annotations

from itertools import pairwise
from math import inf, isclose, isfinite, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.studies.richardson import extrapolate

RATIO = st.floats(1.3, 2.5)


@given(
    p=st.sampled_from([0.5, 1.0, 1.5, 2.0]),
    limit=st.floats(-3.0, 3.0).filter(lambda x: abs(x) > 0.1),
    ratios=st.lists(RATIO, min_size=2, max_size=4),
)
def test_the_limit_and_order_of_a_power_law_are_found(
    p: float, limit: float, ratios: list[float]
) -> None:
    h = [1.0]
    for ratio in ratios:
        h.insert(0, h[0] * ratio)
    values = [limit + 0.01 * one**p for one in h]
    found = extrapolate(h, values)
    assert found.trusted
    # The search for the order ends at 1e-5 of it.
    assert isclose(found.order, p, rel_tol=1e-3)
    assert isclose(found.limit, limit, rel_tol=1e-8)
    # A quarter more than its distance from the limit, as the grid convergence index.
    assert isclose(found.index, 1.25 * 0.01 / abs(values[-1]), rel_tol=1e-6)


@given(p=st.floats(0.5, 4.0), ratios=st.tuples(RATIO, RATIO), sign=st.sampled_from([-1.0, 1.0]))
def test_bars_hold_for_orders_that_are_not_among_those_tried(
    p: float, ratios: tuple[float, float], sign: float
) -> None:
    h = [ratios[0] * ratios[1], ratios[1], 1.0]
    values = [5.0 + sign * 0.01 * one**p for one in h]
    found = extrapolate(h, values)
    for value in values:
        # Half way between two orders the law leaves 1 % of the coarsest value's distance.
        bar = abs(value - found.limit) + found.uncertainty
        assert bar >= (1.0 - 0.015) * abs(value - 5.0)


@given(p=st.sampled_from([-1.0, -0.5, -0.3]), ratios=st.tuples(RATIO, RATIO))
def test_a_singular_value_has_no_limit(p: float, ratios: tuple[float, float]) -> None:
    h = [ratios[0] * ratios[1], ratios[1], 1.0]
    found = extrapolate(h, [one**p for one in h])
    assert "no limit is in sight" in found.warning
    assert found.bar >= max(b - a for a, b in pairwise(one**p for one in h))


def test_what_may_not_be_extrapolated_says_so() -> None:
    h = [4.0, 2.0, 1.0]
    crossing = extrapolate(h, [1.0, 1.2, 1.1])
    assert "asymptotic range" in crossing.warning
    assert crossing.bar > 0.05  # half of the last change
    assert "no limit is in sight" in extrapolate(h, [1.0, 1.1, 1.3]).warning
    assert "nothing can be observed" in extrapolate(h, [1.0, 1.0, 1.0]).warning
    assert extrapolate(h, [1.16, 1.04, 1.01]).trusted
    with pytest.raises(ValueError, match="three results"):
        extrapolate(h[:2], [1.0, 2.0])
    with pytest.raises(ValueError, match="fall from coarse to fine"):
        extrapolate([1.0, 2.0, 4.0], [1.0, 2.0, nan])


@given(values=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=6))
def test_bars_are_finite_whatever_the_values(values: list[float]) -> None:
    h = [2.0 ** (-0.5 * k) for k in range(len(values))]
    found = extrapolate(h, values)
    assert 0.0 <= found.bar < inf
    assert isfinite(found.limit)
