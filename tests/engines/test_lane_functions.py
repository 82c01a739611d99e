"""Functions of lanes beside those of NumPy, at ordinary and at exceptional arguments."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from solidsph.engines.compiled.fixed import lane_arithmetic, lane_functions
from solidsph.engines.compiled.fixed.lane_tensors import WIDTH
from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array

assert lane_arithmetic, lane_functions  # what formulas of lanes are made of

_load, _store, *_ = lane_operations("float64", WIDTH, 1)

EXCEPTIONS = [0.0, -0.0, np.inf, np.nan, 5e-324, 1e-310, 2.2e-308, 1.7e308, 1.0, -1.0, -2.0]
OF_EXP = [-np.inf, 709.7, 709.8, 710.0, -708.3, -745.1, -745.2, -1e300, 0.3465, 0.3466]


def by_lanes(function: Callable[[Any], Any], x: Array) -> Array:
    of_lanes = njit(error_model="numpy")(function)

    @njit
    def run(given, found):
        for at in range(0, len(given), WIDTH):
            _store(found, at, of_lanes(_load(given, at)))

    given = np.concatenate([x, np.ones(-len(x) % WIDTH)])
    found = np.empty_like(given)
    run(given, found)
    return found[: len(x)]


def assert_close(function: Callable[[Any], Any], x: Array, last_digits: float) -> None:
    """Equal where the result is exceptional, and to so many units of the last digit elsewhere."""
    found = by_lanes(function, x)
    with np.errstate(all="ignore"):
        expected = function(x)
        misses = np.abs(found - expected) / np.spacing(np.abs(expected))
    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    assert not np.isnan(misses[~same]).any(), x[~same & np.isnan(misses)]
    assert misses[~same].max(initial=0.0) <= last_digits


# NumPy's own are within one unit: two, and one for expm1 where it adds up two parts.


def test_exponentials():
    rng = np.random.default_rng(0)
    x = [EXCEPTIONS, OF_EXP, rng.uniform(-745.0, 710.0, 5000), rng.uniform(-1.0, 1.0, 5000)]
    assert_close(lambda x: np.exp(x), np.concatenate(x), 2.0)
    x += [1e-7 * rng.standard_normal(1000), rng.uniform(-50.0, 50.0, 5000)]
    assert_close(lambda x: np.expm1(x), np.concatenate(x), 3.0)


def test_logarithms():
    rng = np.random.default_rng(0)
    x = [EXCEPTIONS, [-np.inf], np.exp(rng.uniform(-740.0, 709.0, 5000))]
    x += [rng.uniform(0.5, 2.0, 5000), 1.0 + 1e-9 * rng.standard_normal(1000)]
    assert_close(lambda x: np.log(x), np.concatenate(x), 2.0)


@pytest.mark.parametrize("exponent", [0.3, -2.0 / 3.0, 1.1, 0.0, 2.0, -3.0, 4.0])
def test_powers(exponent):
    """The error of b log(a) is that of the result: some digits at the ends of what there is."""
    rng = np.random.default_rng(0)
    x = [np.exp(rng.uniform(-1.0, 1.0, 5000)), -np.exp(rng.uniform(-1.0, 1.0, 1000))]
    assert_close(lambda x: x**exponent, np.concatenate(x), 8.0)
    # The sign of zero is lost.
    exceptions = [x for x in EXCEPTIONS if str(x) != "-0.0"]
    assert_close(lambda x: x**exponent, np.array([*exceptions, *np.geomspace(1e-30, 1e30)]), 500.0)


def test_products_for_squares_and_cubes():
    x = np.array([-3.0, 0.1, 7.0])
    np.testing.assert_array_equal(by_lanes(lambda x: x**2, x), x * x)
    np.testing.assert_array_equal(by_lanes(lambda x: x**3, x), x * x * x)


def test_comparisons_are_of_every_lane():
    x = np.linspace(-1.0, 1.0, 21)
    found = by_lanes(lambda x: 1.0 * (x > 0.0) + 2.0 * (x <= -0.5) + (x == 1.0), x)
    np.testing.assert_array_equal(found, 1.0 * (x > 0.0) + 2.0 * (x <= -0.5) + (x == 1.0))


def test_a_number_stands_for_lanes_in_one_branch():
    def branching(x):
        # A compiled function, so that both are one type.
        if np.any(x > 0.5):
            return -x
        return 2.0

    x = np.repeat([0.4, 0.6], WIDTH)
    np.testing.assert_array_equal(by_lanes(branching, x), np.repeat([2.0, -0.6], WIDTH))


def test_one_value_or_another():
    x = np.linspace(-1.0, 1.0, 21)
    found = by_lanes(lambda x: np.where(x > 0.2, x, -1.0) + np.where(x < 0.0, 2.0, x), x)
    np.testing.assert_array_equal(found, np.where(x > 0.2, x, -1.0) + np.where(x < 0.0, 2.0, x))
