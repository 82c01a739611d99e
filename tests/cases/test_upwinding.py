"""Upwinding by a skewed kernel: what the spectrum says, and that the gradient keeps its promise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from solidsph import SceneError
from solidsph.studies.case_run import run_case
from solidsph_builtin.gradients.corrected import Corrected
from solidsph_builtin.gradients.skewed import Skewed
from solidsph_cases.upwinding import Upwinding
from tests.helpers.scenes import box


def test_the_case_comes_out_as_it_says(tmp_path: Path) -> None:
    result = run_case(Upwinding(skews=(0.0, 0.5), particles=40), tmp_path)
    assert result.passed, [m for m in result.measurements if not m.passed]
    assert all(path.exists() for path in (*result.pictures, *result.tables))
    # Weights 1 + s and 1 - s of the two neighbours in turn: the alternating motion is seen in
    # proportion to the skew.
    half = run_case(Upwinding(skews=(0.0, 0.25), particles=40), tmp_path)
    seen = [r.measurements[3].value for r in (result, half)]
    assert seen[0] / seen[1] == pytest.approx(2.0, rel=1e-3)


def test_without_skew_it_is_the_corrected_gradient() -> None:
    body = box(2, 6).build().model.bodies[0]
    pairs = body.pairs()
    slopes = body.smoothing.gradient(pairs.offsets, pairs.distances)
    weights = [g.weights(pairs, slopes, body.particles.cells) for g in (Skewed(0.0), Corrected())]
    assert np.array_equal(*weights)


def test_refusals() -> None:
    with pytest.raises(SceneError, match="between -1 and 1, got 1"):
        Skewed(1.0)
    with pytest.raises(SceneError, match="unknown axis 'w'"):
        Skewed(axis="w")
    with pytest.raises(SceneError, match="must hold 0"):
        Upwinding(skews=(0.5,))
