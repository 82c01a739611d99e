"""The front of a sweep, its orders and its prices, on points of which all is known."""

from __future__ import annotations

from itertools import pairwise
from math import inf, isclose, isnan
from pathlib import Path

import attrs
import pandas
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.studies.frontier import Frontier, fitted_exponent
from solidsph.studies.frontier_picture import draw_frontier
from solidsph.studies.point import Point

# error = a h^p, time = b h^-q, so that error ~ time^(-p / q)
SCHEMES = {"first": (1.0, 1.0, 1e-5, 3.0), "second": (25.0, 2.0, 4e-5, 3.0)}
SPACINGS = (0.1, 0.05, 0.025, 0.0125)


def point(error: float, time: float, **settings: object) -> Point:
    return Point(settings, error, spacing=0.1, seconds=(time,))


def known(scheme: str, h: float, noise: float = 1.0) -> Point:
    a, p, b, q = SCHEMES[scheme]
    time = b * h**-q
    return Point(
        {"spacing": h, "scheme": scheme},
        error=a * h**p,
        spacing=h,
        # The median of three is the law, whatever the others are.
        seconds=(time, time * noise, time / noise),
        pair_evaluations=int(1e6 * time),
    )


@pytest.fixture
def frontier() -> Frontier:
    points = [known(scheme, h, 1.3) for h in SPACINGS for scheme in SCHEMES]
    return Frontier(
        [*points, Point({"spacing": 0.2, "scheme": "first"}, inf, "diverged")], "spacing"
    )


def test_orders_are_those_of_the_laws(frontier: Frontier) -> None:
    orders = {one.settings["scheme"]: one for one in frontier.orders()}
    for scheme, (_, p, _, q) in SCHEMES.items():
        assert isclose(orders[scheme].in_spacing, p, rel_tol=1e-12)
        assert isclose(orders[scheme].in_time, p / q, rel_tol=1e-12)
        assert not orders[scheme].crosses


def test_the_front_is_that_of_the_laws(frontier: Frontier) -> None:
    finished = [one for one in frontier.points if one.finished]
    expected = [
        one
        for one in finished
        if not any(
            (other.time <= one.time and other.error < one.error)
            or (other.time < one.time and other.error <= one.error)
            for other in finished
        )
    ]
    assert sorted(map(Point.label, frontier.front())) == sorted(map(Point.label, expected))
    # The second-order scheme is worse at first, and better in the end.
    schemes = [one.settings["scheme"] for one in frontier.front()]
    assert schemes == ["first", "first", "first", "second", "first", "second"]
    assert {one["on the front"] for one in frontier} == {True, False}
    by_work = frontier.front(lambda one: one.pair_evaluations)
    assert [one.label() for one in by_work] == [one.label() for one in frontier.front()]


def test_the_price_of_a_digit_is_that_of_the_law() -> None:
    only = Frontier([known("second", h) for h in SPACINGS], "spacing")
    assert isclose(only.next_digit(), 10.0**1.5, rel_tol=1e-12)


def test_what_an_accuracy_and_a_time_buy(frontier: Frontier) -> None:
    cheapest = frontier.cheapest(0.02)
    assert cheapest is not None
    others = [one for one in frontier.points if one.error <= 0.02]
    assert cheapest.time == min(one.time for one in others)
    assert frontier.cheapest(1e-9) is None
    best = frontier.best(10.0)
    assert best is not None
    assert best.error == min(one.error for one in frontier.points if one.time <= 10.0)
    assert frontier.best(1e-9) is None
    worse = attrs.evolve(cheapest, seconds=(2.0 * cheapest.time,))
    assert frontier.excess(cheapest) == 1.0
    assert isclose(frontier.excess(worse), 2.0)


def test_the_sentence_says_what_to_do(frontier: Frontier) -> None:
    said = frontier.sentence()
    cheapest = frontier.cheapest(0.01)
    assert cheapest is not None
    assert f"1 % takes {cheapest.time:.2g} s with {cheapest.label()}" in said
    assert "further digit" in said
    assert "no configuration finished: diverged" in Frontier(frontier.points[-1:], "h").sentence()
    assert "10 % was not reached" in Frontier([point(0.5, 1.0, h=1)], "h").sentence()


def test_an_error_that_refinement_takes_back_is_not_trusted() -> None:
    lucky = [
        attrs.evolve(known("first", h), error=e)
        for h, e in zip(SPACINGS, (0.03, 0.001, 0.02, 0.005), strict=True)
    ]
    sound = attrs.evolve(known("second", 0.05), error=0.01, seconds=(lucky[1].time,))
    made = Frontier([*lucky, sound], "spacing")
    assert [made.trusted(point) for point in lucky] == [0.03, 0.02, 0.02, 0.005]
    assert made.front() == [lucky[0], sound, lucky[3]]
    assert made.cheapest(0.001) is None
    assert made.cheapest(0.01) == sound


def test_refinement_that_moves_away_is_told() -> None:
    away = Frontier(
        [
            attrs.evolve(known("first", h), error=e)
            for h, e in zip(SPACINGS, (3, 1, 2, 3), strict=True)
        ],
        "spacing",
    )
    assert away.orders()[0].crosses


@given(
    st.lists(
        st.tuples(st.floats(1e-6, 1.0), st.floats(1e-3, 1e3)), min_size=1, max_size=30, unique=True
    )
)
def test_no_point_beats_the_front(pairs: list[tuple[float, float]]) -> None:
    # Each a scheme of its own.
    frontier = Frontier([point(e, t, n=n) for n, (e, t) in enumerate(pairs)], "h")
    front = frontier.front()
    assert front
    for one in frontier.points:
        assert frontier.excess(one) >= 1.0
        assert any(best.time <= one.time and best.error <= one.error for best in front)
    assert all(a.time < b.time and a.error > b.error for a, b in pairwise(front))


def test_pandas_takes_it(frontier: Frontier) -> None:
    table = pandas.DataFrame(frontier)
    assert len(table) == len(frontier)
    assert table["time [s]"].min() == min(one.time for one in frontier.points)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [1, 3])
def test_equal_errors_are_drawn(number: int, tmp_path: Path) -> None:
    points = [attrs.evolve(point(1.0, 1.0, h=n), spacing=0.1 * 2.0**n) for n in range(number)]
    draw_frontier(Frontier(points, "h"), "equal", tmp_path / "equal.png")
    assert (tmp_path / "equal.png").exists()


def test_little_help_is_no_price() -> None:
    front = Frontier([point(0.11, 1.0, h=1), point(0.1, 2.0, h=2)], "h")  # 2^24 for a digit
    assert "hardly makes the error smaller" in front.sentence()
    assert "digit" not in front.sentence()
    assert "110 %" in Frontier([point(1.1, 1.0, h=1)], "h").sentence()


def test_a_power_needs_two_costs() -> None:
    assert isclose(fitted_exponent([1.0, 2.0, 4.0], [1.0, 0.25, 0.0625]), -2.0)
    assert isnan(fitted_exponent([1.0], [1.0]))
    assert isnan(fitted_exponent([1.0, 1.0], [1.0, 2.0]))
