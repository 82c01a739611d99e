"""Reading between particles: exact for what it is made for, and its errors elsewhere."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.maths.arrays import Array
from tests.bare.reading import fitted, period_of, zigzag
from tests.bare.scene import Fields, body, elastic, histories


def lattice(d: int, cells: int) -> Array:
    line = np.linspace(0.0, 1.0, cells + 1)
    return np.stack(np.meshgrid(*[line] * d), axis=-1).reshape(-1, d)


@given(
    d=st.integers(1, 3),
    seed=st.integers(0, 2**16),
    jitter=st.floats(0.0, 0.2),
    cells=st.integers(4, 6),
)
def test_quadratic_fields_are_read_exactly(d: int, seed: int, jitter: float, cells: int) -> None:
    rng = np.random.default_rng(seed)
    X = lattice(d, cells) + jitter / cells * rng.uniform(-1.0, 1.0, ((cells + 1) ** d, d))
    a, b, c = rng.normal(size=(d, d)), rng.normal(size=d), rng.normal()

    def field(x: Array) -> Array:
        return np.asarray(np.einsum("ki,ij,kj->k", x, a, x) + x @ b + c)

    corners = np.vstack([np.zeros(d), np.ones(d), rng.uniform(0.0, 1.0, (5, d))])
    read = fitted(X, 1.0 / cells, field(X), corners)
    assert read == pytest.approx(field(corners), abs=1e-8 * (1.0 + float(np.abs(field(X)).max())))


def test_lames_stress_is_read_to_a_quarter_of_a_per_cent_at_8_across() -> None:
    """So much of the bar of 2 % is the reading's own."""
    rows = [
        r * np.stack([np.cos(t), np.sin(t)], axis=1)
        for r in np.linspace(1.0, 2.0, 8)
        for t in [np.linspace(0.0, 0.5 * np.pi, round(0.5 * np.pi * r * 7) + 1)]
    ]
    X = np.concatenate(rows)
    inner = rows[0]
    read = fitted(X, 1.0 / 7.0, 1.0 + 4.0 / np.sum(X**2, axis=1), inner)
    assert np.abs(read / 5.0 - 1.0).max() < 2.5e-3


def test_kirschs_peak_is_read_to_a_per_cent_at_20_a_side() -> None:
    """In a whole sheet, where 24 particles go around the hole, as in a quarter."""
    h = 0.05
    rows = [
        r * np.stack([np.cos(t), np.sin(t)], axis=1)
        for r in 0.2 + h * np.arange(8)
        for steps in [round(0.5 * np.pi * r / h)]
        for t in [0.5 * np.pi * np.arange(4 * steps) / steps]
    ]
    whole = np.concatenate(rows)
    quarter = whole[(whole > -1e-9).all(axis=1)]
    peaks = []
    for X in (whole, quarter):
        a2 = 0.04 / np.sum(X**2, axis=1)
        c = (X[:, 0] ** 2 - X[:, 1] ** 2) * a2 / 0.04
        c4 = 2.0 * c**2 - 1.0
        stress = 1.0 - a2 * (1.5 * c + c4) + 1.5 * a2**2 * c4
        peaks.append(float(fitted(X, h, stress, np.array([[0.0, 0.2]]))[0]) / 3.0)
    assert np.abs(np.array(peaks) - 1.0).max() < 0.01
    assert abs(peaks[0] - peaks[1]) < 0.01


def test_a_zigzag_is_told_from_a_smooth_field() -> None:
    fields = moving_block()
    X = fields.places
    smooth = np.sin(2.0 * X[:, 0]) * np.exp(X[:, 1])
    assert zigzag(fields, smooth) < 2e-3
    alternating = (-1.0) ** np.round(10.0 * X.sum(axis=1))
    # Values that differ by 2 over a range of 2.
    assert zigzag(fields, alternating) == pytest.approx(1.0, abs=0.1)
    mixed = smooth + 0.02 * np.ptp(smooth) * alternating
    assert zigzag(fields, mixed) == pytest.approx(0.04, rel=0.1)


def moving_block() -> Fields:
    """A block that flies, of which everything is known."""
    read: list[Fields] = []

    def keep(fields: Fields) -> float:
        read.append(fields)
        return float(fields.u[:, 0].mean())

    shape = {"type": "box", "lengths": [1.0, 1.0]}
    builder = body(shape, 0.1, elastic("neo-hookean", 1e6, 0.3, 1000.0))
    times, moved = histories(builder.initial(velocity={"x": 2.0, "y": 0.0}), 0.02, 4, keep)
    assert len(times) == 5
    assert moved == pytest.approx(2.0 * times, abs=1e-12)
    assert attrs.asdict(read[-1], recurse=False)["sigma"] == pytest.approx(
        0.0, abs=1e-3
    )  # of a megapascal
    return read[-1]


def test_the_period_of_a_half_swing() -> None:
    times = np.linspace(0.0, 0.55, 45)
    assert period_of(times, 3e-6 * np.sin(2.0 * np.pi * times / 1.03), 1.0) == pytest.approx(1.03)
