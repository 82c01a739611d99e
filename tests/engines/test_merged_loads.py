"""Loads among the internal forces: beside a history, beside each other, by threads."""

from __future__ import annotations

import pytest
from numba.core.config import NUMBA_NUM_THREADS

from solidsph.engines.compiled.fixed import partition
from solidsph.engines.compiled.time_loop.merged import MergedPenalty, MergedRate
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing.examples import example_part
from tests.engines.test_time_loop import assert_agree, box, loops

HOURGLASS, DASHPOT = ("hourglass-control", {}), ("kelvin-voigt", {"time": 1e-5})


def with_effects(builder: SceneBuilder, *effects: tuple[str, dict[str, float]]) -> SceneBuilder:
    builder = builder.boundary("clamp", where="left")
    for name, parameters in effects:
        builder = builder.effect(name, **parameters)
    return builder


@pytest.mark.parametrize("effect", [HOURGLASS, DASHPOT])
def test_beside_a_material_that_remembers(effect: tuple[str, dict[str, float]]) -> None:
    law = example_part("materials", "viscoelastic")
    assert_agree(with_effects(box(1, 24).material(law), effect))


def test_one_is_merged_and_the_other_has_a_pass_of_its_own() -> None:
    builder = with_effects(box(1, 24), DASHPOT, HOURGLASS)
    _, loop, _ = loops(builder)
    kinds = [type(one.merged) for one in loop.loads]
    assert kinds == [MergedRate, type(None)]
    assert_agree(builder)


def test_work_goes_on_over_portions_of_a_stretch() -> None:
    builder = with_effects(box(1, 24), DASHPOT)
    simulation, loop, by_step = loops(builder)
    whole = loop.advance(simulation.start(), 11)
    object.__setattr__(loop, "most_steps", 2)
    portions = loop.advance(simulation.start(), 11)
    for label, work in by_step.advance(simulation.start(), 11).work.items():
        assert whole.work[label] == pytest.approx(work, rel=1e-12, abs=1e-12)
        assert portions.work[label] == pytest.approx(work, rel=1e-12, abs=1e-12)


@pytest.mark.validation  # half a minute of compiling
@pytest.mark.skipif(NUMBA_NUM_THREADS < 2, reason="there is one thread only")
@pytest.mark.parametrize(("effect", "kind"), [(HOURGLASS, MergedPenalty), (DASHPOT, MergedRate)])
def test_threads_give_the_same_bits_each_time(
    effect: tuple[str, dict[str, float]], kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(partition, "WORTH_A_THREAD", 1)
    builder = with_effects(box(2, 20), effect)
    simulation, loop, _ = loops(builder)
    assert loop.threads > 1
    assert isinstance(loop.loads[0].merged, kind)
    state = simulation.start()
    one, again = loop.advance(state, 6), loop.advance(state, 6)
    assert (one.positions == again.positions).all()
    assert one.work == again.work
    assert_agree(builder)
