"""The sheet at rest: arrangements of particles, and errors that fall at every refinement."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest

from solidsph import SceneError
from solidsph.results.record import Record
from solidsph.simulation import Simulation
from solidsph.studies.case_run import CaseResult, run_case
from solidsph_cases.sheet_convergence import SheetConvergence

COARSE = SheetConvergence(across=(15, 30))
NAMES = ("rows along the hole", "rows up to the hole", "no rows")


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> CaseResult:
    return run_case(COARSE, tmp_path_factory.mktemp("convergence"))


@pytest.fixture(scope="module")
def records(outcome: CaseResult) -> Iterator[Mapping[str, Record]]:
    opened = {run.name: Record(run.record) for run in outcome.runs}
    yield opened
    for record in opened.values():
        record.close()


@pytest.mark.parametrize("name", NAMES)
def test_errors_fall_faster_than_the_spacing(records: Mapping[str, Record], name: str) -> None:
    coarse, fine = COARSE.errors(records, name)
    # Half a per cent with three particles to the radius, in any arrangement.
    assert coarse < 0.006
    # On the recommended particles so little that the reference's digits begin to count.
    assert fine < coarse / 2.0 or fine < coarse < 1e-3
    (order,) = [m for m in COARSE.measure(records) if m.quantity.startswith(f"{name}: order")]
    assert order.value == pytest.approx(np.log(coarse / fine) / np.log(2.0))
    assert order.verdict == "falls at every refinement"
    assert order.passed


@pytest.mark.parametrize("name", NAMES)
def test_an_error_that_grows_does_not_pass(records: Mapping[str, Record], name: str) -> None:
    dashed = name.replace(" ", "-")
    swapped = {
        **records,
        f"{dashed}-15": records[f"{dashed}-30"],
        f"{dashed}-30": records[f"{dashed}-15"],
    }
    (order,) = [m for m in COARSE.measure(swapped) if m.quantity.startswith(f"{name}: order")]
    assert order.verdict == "does NOT fall at every refinement"
    assert not order.passed


def test_the_peak_is_where_theory_has_it(outcome: CaseResult) -> None:
    peaks = [m for m in outcome.measurements if "largest principal" in m.quantity]
    assert len(peaks) == 6
    for m in peaks:
        away = re.search(r"([0-9.]+) spacings from", m.verdict)
        assert away is not None
        assert float(away[1]) <= 1.5


def test_a_peak_elsewhere_does_not_pass(
    records: Mapping[str, Record], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the sheet is asked for a peak far from (0, a), it has none there."""
    before = [m for m in COARSE.measure(records) if "largest principal" in m.quantity]
    assert any(m.passed for m in before)
    monkeypatch.setattr(SheetConvergence, "radius", 0.6)
    peaks = [m for m in COARSE.measure(records) if "largest principal" in m.quantity]
    assert not any(m.passed for m in peaks)


def test_arrangements_are_what_they_are_called() -> None:
    case = SheetConvergence(across=(10, 20))
    found = {
        name: Simulation.builder(case.scenes()[f"{name.replace(' ', '-')}-20"]).build().particles
        for name in NAMES
    }
    for particles in found.values():
        # Nearly 21 x 21 but for the hole; all have the area of the sheet and a particle at (0, a).
        assert 400 < particles.count < 441
        assert particles.volumes.sum() == pytest.approx(1.0 - 0.01 * np.pi, rel=1e-3)
        assert np.linalg.norm(particles.positions - [0.0, 0.2], axis=1).min() < 1e-6
        rim = particles.positions[particles.tags["rim"]]
        assert np.hypot(*rim.T) == pytest.approx(0.2, abs=1e-6)
    along, up, none = (found[name] for name in NAMES)

    # On a lattice coordinates are multiples of the spacing, but for those moved to fit the
    # hole, up to some spacings from it.
    def on_lattice(X: np.ndarray) -> float:
        return float(np.isclose(20.0 * X, np.round(20.0 * X), atol=1e-4).all(axis=1).mean())

    assert on_lattice(up.positions[up.tags["interior"]]) > 0.7
    assert on_lattice(none.positions[none.tags["interior"]]) < 0.01
    assert along.tags["rim"].sum() == 9  # half the side of the square before, four, twice, and one


def test_what_is_held_against_cost_is_the_finest(
    outcome: CaseResult, records: Mapping[str, Record]
) -> None:
    error = COARSE.accuracy(outcome.measurements).error
    assert error == pytest.approx(COARSE.errors(records, NAMES[0])[-1])


def test_pictures_and_tables(outcome: CaseResult, records: Mapping[str, Record]) -> None:
    (picture,) = outcome.pictures
    assert picture.name == "section-5.4-convergence.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    (table,) = COARSE.curves(records).values()
    assert len(table) == 1 + 2 * len(NAMES)
    np.testing.assert_allclose(table["spacing over W [1]"], [1 / 15, 1 / 30])
    for name in NAMES:
        np.testing.assert_array_equal(
            table[f"{name}: error of u_x [1]"], COARSE.errors(records, name)
        )


def test_other_sheets_have_no_reference_but_a_picture(tmp_path: Path) -> None:
    outcome = run_case(SheetConvergence(traction=4e6, across=(10, 12)), tmp_path)
    assert outcome.passed
    assert all(m.reference is None for m in outcome.measurements)
    assert len(outcome.measurements) == 12
    assert len(outcome.pictures) == 1
    assert not outcome.tables


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"across": (20,)}, "across must be two numbers or more"),
        ({"across": (30, 20)}, "each larger than the one before, got [30, 20]"),
        ({"across": (1, 20)}, "each of across must be a whole number of at least 2, got 1"),
        ({"across": (2, 20)}, "needs a spacing below it, got 0.5"),
        ({"hole_ratio": 0.0}, "hole_ratio must lie between 0 and 0.7, got 0.0"),
        ({"traction": -5e6}, "traction must be positive"),
    ],
)
def test_a_wrong_parameter_is_one_clear_message(parameters: dict, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        SheetConvergence(**parameters)
    assert expected in str(caught.value)


@pytest.mark.validation
def test_all_is_within_its_bars_from_21_by_21_to_61_by_61(tmp_path: Path) -> None:
    outcome = run_case(SheetConvergence(across=(20, 30, 40, 60)), tmp_path)
    assert outcome.passed, outcome.measurements


@pytest.mark.validation
@pytest.mark.parametrize("seed", [2, 3])
def test_errors_fall_with_other_random_numbers(tmp_path: Path, seed: int) -> None:
    outcome = run_case(SheetConvergence(seed=seed), tmp_path)
    assert outcome.passed, outcome.measurements
