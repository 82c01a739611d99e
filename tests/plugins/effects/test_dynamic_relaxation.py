"""Dynamic relaxation comes to rest where statics does, and sooner than a fixed rate."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import Simulation, solve
from solidsph.errors import BuildError
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import frequencies


def hanging() -> SceneBuilder:
    """A beam of 20 by 4 that is clamped at the left and bends under its weight."""
    return (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [1.0, 0.2]}, spacing=0.05)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .boundary("clamp", where="left")
        .effect("body-force", acceleration={"y": -2.0})
        .duration(2.2)
    )


def test_it_comes_to_rest_at_the_equilibrium() -> None:
    at_rest = solve(hanging().statics().build()).state.positions
    made = hanging().build()
    sag = np.abs(at_rest - made.particles.positions).max()
    left = {}
    for name, builder in (
        ("relaxed", hanging().effect("dynamic-relaxation")),
        ("slowly damped", hanging().effect("mass-damping", rate=1.0)),
    ):
        state = builder.build().run().state
        left[name] = np.abs(state.positions - at_rest).max() / sag
    # Two periods of the first bending mode, at close to its critical rate: w t = 12.
    assert left["relaxed"] < 1e-3
    assert left["slowly damped"] > 0.05


def test_its_rate_is_critical_for_the_slowest_motion() -> None:
    made = hanging().effect("dynamic-relaxation").build()
    slowest = frequencies(hanging().build(), 1).angular_frequencies[0]
    state, loop, rates = made.start(), made.time_loop(), []
    for stop in range(made.steps // 10, made.steps, made.steps // 10):
        state = loop.advance(state, stop)
        rates.append(float(state.memory["dynamic-relaxation: rate"][0]))
    # A quotient is never below the lowest, and that of the way gone is close to it: its shape is
    # that of a beam under its weight.
    assert rates[-1] == pytest.approx(2.0 * slowest, rel=0.02)


def test_a_wrong_damping_is_refused() -> None:
    with pytest.raises(BuildError, match="1 is critical"):
        hanging().effect("dynamic-relaxation", damping=0.0).build()
