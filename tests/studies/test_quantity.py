"""Quantities of a scene, and what they should be."""

from __future__ import annotations

from math import pi, sin
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import Scene, SceneError
from solidsph.studies.quantity import Quantity, quantities
from solidsph.studies.reference import Reference
from tests.helpers.scenes import SCENE_TOML

PROBES = """
[[probe]]
label = "end"
quantity = "displacement"
point = [1.0, 0.25]

[[probe]]
label = "top"
quantity = "stress xx"
line = {from = [0.0, 0.5], to = [1.0, 0.5]}
"""
SCENE = Scene.from_toml(SCENE_TOML + PROBES)
COLUMNS = (
    "kinetic energy [J]",
    "end displacement x [m]",
    "end displacement y [m]",
    "top mean stress xx [Pa]",
    "top minimum stress xx [Pa]",
    "top maximum stress xx [Pa]",
    "top maximum at x [m]",
)


def record(times: Any, **columns: Any) -> Any:
    """What a quantity reads of a record."""
    history = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    return SimpleNamespace(times=np.asarray(times, dtype=float), history=history, path="a.h5")


def names(*wanted: str) -> list[str]:
    return [quantity.name for quantity in quantities(SCENE, COLUMNS, wanted)]


def test_all_probes_are_asked_for_but_for_the_places_of_extremes() -> None:
    expected = [f"{how} {column}" for column in COLUMNS[1:6] for how in ("final", "peak")]
    assert names() == expected


def test_a_column_a_probe_and_a_reduction_can_be_named() -> None:
    assert names("kinetic energy") == ["final kinetic energy [J]", "peak kinetic energy [J]"]
    assert names("mean kinetic energy [J]") == ["mean kinetic energy [J]"]
    assert names("peak end") == ["peak end displacement x [m]", "peak end displacement y [m]"]
    # The probe's own "mean" is not taken for a reduction.
    assert names("final top mean stress xx") == ["final top mean stress xx [Pa]"]
    still = Scene.from_toml(SCENE_TOML + PROBES + "[statics]\n")
    assert [q.reduction for q in quantities(still, COLUMNS, ["end"])] == ["final", "final"]


def test_what_is_not_there_is_told() -> None:
    with pytest.raises(SceneError, match="did you mean 'end displacement x'"):
        names("end displacment x")
    with pytest.raises(SceneError, match=r"no \[\[probe\]\].*kinetic energy"):
        quantities(Scene.from_toml(SCENE_TOML), COLUMNS)


def test_components_of_a_probe_share_a_scale() -> None:
    x, y = quantities(SCENE, COLUMNS, ["final end"])
    made = record(
        [0.0, 1.0], **{"end displacement x [m]": [0.0, -2.0], "end displacement y [m]": [0.0, 1e-9]}
    )
    assert (x.value(made), y.value(made)) == (-2.0, 1e-9)
    assert x.scale(made) == y.scale(made) == 2.0
    with pytest.raises(SceneError, match="no column"):
        x.value(record([0.0], other=[1.0]))


@given(shift=st.floats(-0.5, 0.5), sign=st.sampled_from([-1.0, 1.0]))
def test_a_peak_is_found_between_the_outputs(shift: float, sign: float) -> None:
    times = np.arange(11.0) + shift
    values = sign * (3.0 - 0.05 * (times - 5.2) ** 2)
    found = Quantity("u [m]", "peak").value(record(times, **{"u [m]": values}))
    assert found == pytest.approx(sign * 3.0, rel=1e-12)


def test_a_mean_is_over_time() -> None:
    made = record([0.0, 1.0, 3.0], **{"u [m]": [0.0, 2.0, 2.0]})
    assert Quantity("u [m]", "mean").value(made) == pytest.approx(5.0 / 3.0)


SWING = record(np.linspace(0.0, 1.0, 101), **{"u [m]": np.sin(2.0 * pi * np.linspace(0, 1, 101))})


def reference(given: Any, how: str = "final", **more: Any) -> Reference:
    return Reference.of(Quantity("u [m]", how), given, **more)


def test_a_number_and_a_formula_are_references() -> None:
    found = reference("2/4", "peak").measurement(SWING)
    assert (found.value, found.reference) == (pytest.approx(1.0), 0.5)
    assert found.error == pytest.approx(1.0)
    assert not found.passed
    assert reference(0.99, "peak", tolerance=0.02).measurement(SWING).passed
    # A reference of zero: relative to the largest value.
    assert reference(0.0).measurement(SWING).error == pytest.approx(0.0, abs=1e-12)


def test_a_curve_is_compared_over_time(tmp_path: Path) -> None:
    assert reference("sin(2*pi*t)").measurement(SWING).error == pytest.approx(0.0, abs=1e-12)
    # The root of the mean square of a tenth of a sine over whole periods; a hundredth by its ends.
    shrunk = reference("1.1*sin(2*pi*t)").measurement(SWING).error
    assert shrunk == pytest.approx(0.1 / 1.1 / 2.0**0.5, rel=0.01)
    file = tmp_path / "measured.csv"
    rows = [(0.25 + 0.005 * k, sin(2 * pi * (0.25 + 0.005 * k))) for k in range(101)]
    file.write_text("time [s];u [m]\n" + "\n".join(f"{t};{u}" for t, u in rows))
    found = reference("measured.csv", folder=tmp_path).measurement(SWING)
    assert found.error == pytest.approx(0.0, abs=1e-4)  # of lines between the rows
    assert (found.quantity, found.source) == ("curve of u [m]", "measured.csv")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a,b\n", "two columns"),
        ("0,1\n0,2\n", "rising times"),
        ("5,1\n6,2\n", "covers none of the outputs"),
        ("0,0\n1,0\n", "is zero at all outputs"),
    ],
)
def test_a_file_that_is_no_curve_is_told(content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "measured.csv").write_text(content)
    with pytest.raises(SceneError, match=message):
        reference("measured.csv", folder=tmp_path).measurement(SWING)


@pytest.mark.parametrize("given", ["1/0", "x", "", "missing.csv"])
def test_what_is_no_reference_is_told(given: str) -> None:
    with pytest.raises(SceneError, match=r"reference|formula"):
        reference(given)
