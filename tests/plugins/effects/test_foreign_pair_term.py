"""The pair term of docs/first-pair-term.md: compiled into the loop, priced, put to sleep."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.costs.count import count_work
from solidsph.engines.compiled.time_loop.loop import CompiledLoop
from solidsph.interfaces.plan import SumMethod
from solidsph.run.step_by_step import StepByStep
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.guides import Guide
from tests.helpers.scenes import box


@pytest.fixture
def springs(foreign) -> None:
    Guide.read("first-pair-term").install(foreign)


def moving(cells: int = 6) -> SceneBuilder:
    return box(2, cells).effect("springs", stiffness=50.0).initial(velocity={"x": "Y", "y": "X*Y"})


def test_whole_steps_are_compiled_with_it(springs: None) -> None:
    simulation = moving().engine("compiled").build()
    loop = simulation.time_loop()
    assert isinstance(loop, CompiledLoop)
    start, stop = simulation.start(), simulation.steps
    one = loop.advance(start, stop)
    other = StepByStep(simulation.dynamics, simulation.integrator).advance(start, stop)
    # Both add the same numbers in other orders.
    assert np.abs(one.positions - other.positions).max() < 1e-12
    assert one.work["springs"] == pytest.approx(other.work["springs"], rel=1e-9)
    assert one.work["springs"] != 0.0


def test_its_pairs_are_counted(springs: None) -> None:
    simulation = moving().engine("compiled").build()
    own = count_work(simulation).operations[-1]
    assert own.method is SumMethod.PAIR_LOOPS
    assert own.pairs == simulation.dynamics.internal.pair_count - simulation.particles.count


def test_it_sleeps(springs: None) -> None:
    """Regions that nothing has reached leave it out: what moves is the same."""
    builder = moving(8).engine("matrix")
    plain = builder.build().run().state
    asleep = builder.sleep(slabs=4).build().run().state
    assert np.abs(asleep.positions - plain.positions).max() < 1e-9
