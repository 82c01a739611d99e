"""Section 5.2: the total form spreads the disturbance, the updated form lets it grow.

The updated form's failure is the control that makes the total form's success mean something.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from solidsph.builder import Builder
from solidsph.interfaces.case import Measurement
from solidsph.studies.case_run import CaseResult, run_case
from solidsph.studies.spectrum import spectrum
from solidsph_builtin.cases.tensile_instability import FORMS, TensileInstability


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> CaseResult:
    return run_case(TensileInstability(), tmp_path_factory.mktemp("tensile"))


def measured(outcome: CaseResult, form: str, stretch: float) -> Measurement:
    (found,) = [
        m for m in outcome.measurements if m.quantity == f"{form}, stretch {stretch:g}: growth rate"
    ]
    return found


@pytest.mark.parametrize("stretch", [1.02, 1.2, 1.5])
def test_total_form_does_not_grow(outcome: CaseResult, stretch: float) -> None:
    growth = measured(outcome, "total-lagrangian", stretch)
    # A trend over the whole run: what remains of it is rounding, not growth.
    assert growth.value < 0.01
    assert growth.reference == 0.0
    assert growth.verdict == "stable"
    assert growth.passed


@pytest.mark.parametrize("stretch", [1.02, 1.2, 1.5])
def test_updated_form_grows_at_the_predicted_rate(outcome: CaseResult, stretch: float) -> None:
    growth = measured(outcome, "updated-lagrangian", stretch)
    assert growth.reference is not None
    assert growth.value > 1.0  # e-foldings a transit
    assert growth.value == pytest.approx(growth.reference, rel=0.1)
    assert growth.passed


def test_the_finite_perturbation_spreads_in_one_form_and_clumps_in_the_other(
    outcome: CaseResult,
) -> None:
    spread, grew = outcome.measurements[:2]
    assert spread.quantity.startswith(FORMS[0])
    assert spread.value < 0.5
    assert grew.quantity.startswith(FORMS[1])
    assert grew.value > 2.0
    assert outcome.passed


def test_pictures_and_records_are_there(outcome: CaseResult) -> None:
    (picture,) = outcome.pictures
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 20_000
    assert all(Path(run.record).exists() for run in outcome.runs)


def test_along_the_fastest_mode_the_rate_is_the_predicted_one() -> None:
    """A start in the mode itself, not in one particle: nothing else has to die away first."""
    case = TensileInstability()
    scene = case._scene("updated-lagrangian", 1.5, 0.0, 0.2 * case.transit)
    simulation = Builder(scene).build()
    start = simulation.start()
    modes = spectrum(simulation.dynamics, start)
    fastest = modes.modes[:, 0].real
    # Rows of the inverse are the left modes: their product with a deviation is its amplitude.
    left = np.linalg.inv(modes.modes)[0].real
    deviation = np.zeros_like(start.positions)
    deviation[modes.free] = 1e-9 * case.spacing * fastest

    def amplitude(positions: np.ndarray) -> float:
        return float(left @ (positions - start.positions)[modes.free])

    import attrs

    moved = attrs.evolve(
        start,
        positions=start.positions + deviation,
        velocities=start.velocities + modes.growth_rate * deviation,
    )
    state = simulation.integrator.start(moved, simulation.dynamics, simulation.step_size)
    first = amplitude(state.positions)
    for _ in range(simulation.steps):
        state = simulation.integrator.advance(state, simulation.dynamics, simulation.step_size)
    rate = np.log(amplitude(state.positions) / first) / state.time
    # The scheme's own error is (s dt)^2 / 24, here 1e-3.
    assert rate == pytest.approx(modes.growth_rate, rel=5e-3)


@pytest.mark.parametrize("stretch", [1.02, 1.2, 1.5, 2.0, 0.9])
def test_the_spectrum_of_the_total_form_has_no_growth(stretch: float) -> None:
    case = TensileInstability()
    # Zero modes come out as the square root of rounding in differences, relative to the highest.
    assert case.predicted_rate("total-lagrangian", stretch) * case.transit < 0.01


def test_swapping_the_two_forms_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each form under the other's name: every verdict that depends on the form must fail."""
    original = TensileInstability._scene
    other = {FORMS[0]: FORMS[1], FORMS[1]: FORMS[0]}

    def swapped(self, form, *arguments):
        return original(self, other[form], *arguments)

    monkeypatch.setattr(TensileInstability, "_scene", swapped)
    # Two stretches, and only as long as the mild one allows, to keep the test short.
    outcome = run_case(TensileInstability(stretches=(1.5,)), tmp_path)
    assert [m.passed for m in outcome.measurements] == [False, False, False, False]
    assert not outcome.passed
