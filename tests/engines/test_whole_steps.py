"""Whether whole steps are compiled is said once: the time loop, costs and `explain` agree."""

from __future__ import annotations

import pytest

from solidsph.costs.count import count_work
from solidsph.costs.work import Loop
from solidsph.run.step_by_step import StepByStep
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT, box

GHOSTS = {"type": "lattice", "on_boundary": True, "ghosts": 3}

SCENES = {
    "arrays": (box(1, 12).engine("matrix"), False),
    "a law of F alone": (box(1, 12).engine("compiled"), True),
    "a law that remembers": (
        box(1, 12).engine("compiled").material("j2-plasticity", yield_stress=1e4, **SOFT),
        True,
    ),
    "a law that remembers as much as it is asked to": (
        box(1, 12)
        .engine("compiled")
        .material("viscoelastic", prony=[{"share": 0.3, "time": 0.01}], **SOFT),
        True,
    ),
    "bonds that fail": (
        box(1, 12).engine("compiled").effect("bond-failure", critical_stretch=0.1),
        False,
    ),
    "heat, which is called": (
        box(1, 12)
        .engine("compiled")
        .effect("heat", conductivity=1.0, heat_capacity=500.0, initial="X", expansion=1e-4),
        True,
    ),
    "neighbours that move": (
        box(1, 12).engine("compiled").formulation("updated-lagrangian"),
        False,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_all_that_ask_get_one_answer(name: str) -> None:
    builder, expected = SCENES[name]
    made: SceneBuilder = builder
    simulation = made.build()
    assert simulation.plan.compiles_steps is expected
    assert isinstance(simulation.time_loop(), StepByStep) is not expected
    assert (count_work(simulation).loop is Loop.COMPILED) is expected
