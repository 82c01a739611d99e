"""A case with other words in its scenes than it has parameters for."""

from __future__ import annotations

from typing import Any

import attrs
import pytest

from solidsph import SceneError
from solidsph.assembly import step_size
from solidsph.costs.count import count_work
from solidsph.registry import registry
from solidsph.scene.scene import Scene
from solidsph.scene.scheme import completed
from solidsph.simulation import Simulation
from solidsph.studies import point
from solidsph.studies.case import Case
from solidsph.studies.case_run import run_scenes
from solidsph.studies.point import merge_repeats, run_point
from solidsph.studies.variant import setting_of, with_settings
from solidsph.system.compile_time import COMPILE_TIME
from solidsph_cases.csm3 import Csm3


def scene(**settings: Any) -> Scene:
    return with_settings(
        Csm3(), {name.replace("__", "."): v for name, v in settings.items()}
    ).scenes()["csm3"]


def test_parameters_of_the_case_come_first() -> None:
    assert with_settings(Csm3(), {"across": 9, "duration": 1.0}) == Csm3(across=9, duration=1.0)


def test_other_words_change_the_scene_and_nothing_else() -> None:
    plain = Csm3().scenes()["csm3"]
    assert scene(outputs=7) == attrs.evolve(plain, outputs=7)
    assert scene(precision="float32").engine == "compiled-float32"
    formulation = scene(formulation="updated-lagrangian").formulation
    assert formulation == {**completed(plain).formulation, "type": "updated-lagrangian"}


def test_a_variant_varies_further() -> None:
    once = with_settings(Csm3(), {"gradient": "quadratic", "across": 7})
    twice = with_settings(once, {"across": 9, "cover": 3.0, "hourglass": 0.5})
    assert setting_of(twice, "across") == 9
    assert twice.resolution == Csm3(across=9).resolution
    assert twice.priced().scenes() == twice.scenes()
    assert (twice.title, twice.source, twice.sweep) == (Csm3.title, Csm3.source, Csm3.sweep)
    words = {"gradient": "quadratic", "cover": 3.0, "hourglass": 0.5, "kernel": "cubic-spline"}
    assert {word: setting_of(twice, word) for word in words} == words
    # Control that is taken away leaves the scene as it was, the weight included.
    without = with_settings(Csm3(), {"hourglass": 0.0})
    assert without.scenes() == Csm3().scenes()
    with pytest.raises(SceneError, match="no parameter 'colour'"):
        setting_of(twice, "colour")


def test_strengths_of_effects_are_changed_or_added() -> None:
    gravity, added = scene(**{"hourglass-control__strength": 0.3}).effects
    assert gravity == Csm3().scenes()["csm3"].effects[0]
    assert added.part == {"type": "hourglass-control", "strength": 0.3}
    case = with_settings(Csm3(), {"hourglass": 0.5})
    effects = with_settings(case, {"hourglass-control.strength": 0.2}).scenes()["csm3"].effects
    assert {"type": "hourglass-control", "strength": 0.2} in [one.part for one in effects]
    assert len(effects) == 2


def test_an_unknown_word_names_the_nearest() -> None:
    with pytest.raises(SceneError, match="did you mean 'gradient'"):
        with_settings(Csm3(), {"gradent": "quadratic"})
    with pytest.raises(SceneError, match="across"):
        with_settings(Csm3(), {"across": 1})
    with pytest.raises(SceneError, match="float64 or float32"):
        scene(precision="single")


def test_a_point_counts_what_no_machine_changes() -> None:
    case = with_settings(Csm3(across=3, duration=0.01), {"engine": "matrix"})
    one, two = run_point(case, {"cover": 2.2}), run_point(case, {"cover": 2.2})
    assert attrs.evolve(one, seconds=(), peak_memory=0) == attrs.evolve(
        two, seconds=(), peak_memory=0
    )
    built = Simulation.builder(with_settings(case, {"cover": 2.2}).scenes()["csm3"]).build()
    assert one.steps == built.steps
    assert one.pair_evaluations == built.steps * count_work(built).visited
    assert merge_repeats([one, two]).seconds == (*one.seconds, *two.seconds)


def test_compiling_is_not_in_the_time_of_a_point(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiling(*given: Any) -> Any:
        monkeypatch.setattr(COMPILE_TIME, "seconds", COMPILE_TIME.seconds + 1000.0)
        return run_scenes(*given)

    monkeypatch.setattr(point, "run_scenes", compiling)
    case = with_settings(Csm3(across=3, duration=0.01), {"engine": "matrix"})
    assert run_point(case, {}).time < -900.0


def test_what_goes_wrong_is_a_point_too(monkeypatch: pytest.MonkeyPatch) -> None:
    case = with_settings(Csm3(across=3, duration=0.05), {"engine": "matrix"})
    too_long = run_point(case, {"time_step": 1.8e-4})
    assert "exceeds the critical step" in too_long.outcome
    monkeypatch.setattr(step_size, "safe_step", lambda *scene: None)  # the CFL step is longer
    diverged = run_point(case, {"time_step": 1.8e-4})
    assert not diverged.finished
    assert "diverged" in diverged.outcome
    refused = run_point(case, {"cover": -1.0})
    assert not refused.finished
    assert "cover" in refused.outcome


@pytest.mark.parametrize(
    "name", [name for name in registry.names("cases") if attrs.fields(registry.load("cases", name))]
)
def test_every_case_has_a_sensible_sweep(name: str) -> None:
    case: Case = registry.load("cases", name)()
    priced = case.priced()
    assert priced.sweep
    refining, *_ = priced.sweep
    spacings = [
        with_settings(priced, {refining: value}).resolution for value in priced.sweep[refining]
    ]
    assert len(spacings) >= 2
    assert spacings == sorted(spacings, reverse=True)
    for axis, values in priced.sweep.items():
        assert len(values) == len(set(values)) >= 1
        for value in values:
            with_settings(priced, {axis: value}).scenes()
