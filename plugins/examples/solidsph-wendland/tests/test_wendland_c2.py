"""The kernel keeps what every kernel must keep, and is the published function."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from solidsph_wendland import WendlandC2

from solidsph.parts import construct
from solidsph.testing import MASS_TOLERANCE, Check, checks, smoothed_mass
from solidsph.testing.strategies import dimensions, support_radii


@pytest.mark.parametrize("check", checks("kernels"), ids=lambda check: check.__name__)
def test_conformance(check: Check) -> None:
    result = check(WendlandC2())
    assert result.passed, result


def test_it_is_found_by_its_name() -> None:
    assert construct("kernels", "wendland-c2") == WendlandC2()


@given(dimension=dimensions(), support_radius=support_radii())
def test_unit_mass_whatever_the_support_radius(dimension: int, support_radius: float) -> None:
    assert abs(smoothed_mass(WendlandC2(), dimension, support_radius) - 1.0) < MASS_TOLERANCE


@given(q=st.floats(0.0, 1.0))
def test_published_polynomial(q: float) -> None:
    # Dehnen & Aly (2012), Table 1, expanded: a few roundings of numbers up to 20.
    expanded = 1.0 - 10.0 * q**2 + 20.0 * q**3 - 15.0 * q**4 + 4.0 * q**5
    assert WendlandC2.profile(q, ()) == pytest.approx(expanded, abs=1e-14)
