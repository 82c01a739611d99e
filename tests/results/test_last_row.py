"""What a run measures is in its result, whether it is recorded or not."""

from __future__ import annotations

import pytest

from solidsph import UnsoundError
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import box


def swinging() -> SceneBuilder:
    return (
        box(2)
        .boundary("clamp", where="left")
        .initial(velocity={"y": "X"})
        .probe(label="middle", quantity="velocity", point=[0.5, 0.5])
        .duration(2e-3)
    )


def test_it_is_what_a_record_has(tmp_path) -> None:
    simulation = swinging().build()
    alone, recorded = simulation.run(), simulation.run(record=tmp_path / "record.h5")
    assert alone.final == recorded.final
    assert alone.final["middle velocity y [m/s]"] > 0.1


def test_equilibria_have_it_too(tmp_path) -> None:
    builder = (
        box(2)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": 1e3})
        .statics()
        .probe(label="middle", quantity="displacement x", point=[0.5, 0.5])
    )
    simulation = builder.build()
    alone, recorded = simulation.run(), simulation.run(record=tmp_path / "record.h5")
    assert alone.final == recorded.final


def test_an_unsound_run_has_it_too() -> None:
    with pytest.raises(UnsoundError) as caught:
        swinging().energy_tolerance(1e-12).build().run()
    assert caught.value.result.final["middle velocity y [m/s]"] > 0.1
