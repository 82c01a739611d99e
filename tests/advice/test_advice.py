"""Warnings ahead of a run: each flaw is named with its remedy, and a sound scene hears nothing."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import attrs
import pytest

from solidsph import BuildError, Scene, SceneError, Simulation
from solidsph.advice import ADVICE, Advice, advise, catalogue, thickness
from solidsph.advice.scene_facts import SceneFacts
from solidsph.maths.arrays import Array
from tests.commands.test_cli import solidsph
from tests.helpers.advised_scenes import FLAWED, SOUND, Flawed
from tests.helpers.scenes import SCENE_TOML


@cache
def built(toml: str) -> Simulation:
    """By the engine that compiles nothing: no warning is about engines."""
    return Simulation.builder(Scene.from_toml(toml)).engine("matrix").build()


def heard(toml: str) -> tuple[Advice, ...]:
    return advise(built(toml))


def title(toml: str) -> str:
    text: str = tomllib.loads(toml)["title"]
    return text


@pytest.mark.parametrize("flawed", FLAWED, ids=[title(one.toml) for one in FLAWED])
def test_a_flaw_is_named_and_nothing_else(flawed: Flawed) -> None:
    found = heard(flawed.toml)
    assert {one.name for one in found} == {flawed.name}
    assert flawed.remedy in found[0].remedy
    assert found[0].finding
    assert found[0].expected


@pytest.mark.parametrize("toml", SOUND, ids=title)
def test_a_sound_scene_hears_nothing(toml: str) -> None:
    assert [one.line for one in heard(toml)] == []


def test_every_warning_has_a_flawed_scene() -> None:
    assert {one.name for one in FLAWED} == set(ADVICE)
    assert len(SOUND) >= 12


@pytest.mark.parametrize("toml", [*(one.toml for one in FLAWED), *SOUND], ids=title)
def test_no_warning_fails_where_it_could_be_formed(toml: str) -> None:
    """`advise` leaves out what fails; here it would show."""
    facts = SceneFacts(built(toml))
    for check in ADVICE.values():
        list(check(facts))


def test_a_warning_that_fails_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(facts: SceneFacts) -> Iterator[Advice]:
        raise RuntimeError("a fault")
        yield

    everything = {"broken": broken, **catalogue.ADVICE}
    monkeypatch.setattr(catalogue, "ADVICE", everything)
    assert {one.name for one in heard(FLAWED[0].toml)} == {FLAWED[0].name}


def test_silence_goes_to_toml_and_back() -> None:
    flawed = FLAWED[0]
    toml = f'silence = ["{flawed.name}"]\n{flawed.toml}'
    scene = Scene.from_toml(toml)
    assert heard(toml) == ()
    assert Scene.from_toml(scene.to_toml()).silence == (flawed.name,)
    said = Simulation.builder(built(flawed.toml).scene).silence(flawed.name).scene()
    assert said.silence == (flawed.name,)
    assert advise(Simulation.builder(said).build()) == ()


def test_an_unknown_name_is_one_clear_error() -> None:
    with pytest.raises(BuildError, match=r"no warning is called 'few-acros'.*'few-across'") as told:
        heard(f'silence = ["few-acros"]\n{SCENE_TOML}')
    assert len(told.value.problems) == 1
    with pytest.raises(SceneError, match="silence must be a list of names"):
        Scene.from_toml(f'silence = "few-across"\n{SCENE_TOML}')


def test_explain_and_run_say_it(tmp_path: Path) -> None:
    flawed = next(one for one in FLAWED if one.name == "sudden-load")
    (tmp_path / "blow.toml").write_text(flawed.toml)
    done = solidsph("explain", "blow.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (facts,) = json.loads(done.stdout)["scenes"].values()
    assert [one["name"] for one in facts["warnings"]] == ["sudden-load"]
    done = solidsph("run", "blow.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "warning, sudden-load: 'traction top' loads a surface" in done.stderr


def test_run_tells_it_to_programs_too(tmp_path: Path) -> None:
    (tmp_path / "nothing.toml").write_text(
        next(one.toml for one in FLAWED if one.name == "nothing-happens")
    )
    done = solidsph("run", "nothing.toml", "--json", cwd=tmp_path)
    assert done.stderr == ""
    (told,) = json.loads(done.stdout)["warnings"]
    assert told.startswith("nothing-happens: ")


def test_its_cost_does_not_grow_with_the_body(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it asks most of is the shape, point by point; eight times the particles ask no more."""
    toml = next(one for one in SOUND if "pressed in space" in one)
    toml = toml.replace("hourglass-control", 'mass-damping"\nrate = 2.0 #')  # compiles nothing
    asked: dict[str, int] = {}
    for spacing in ("0.02", "0.01"):
        simulation = built(toml.replace("0.0125", spacing))
        count = 0

        def heights(
            self: thickness.SampledSurface,
            points: Array,
            plain: Callable[..., tuple[Array, Array]] = thickness.SampledSurface.heights,
        ) -> tuple[Array, Array]:
            nonlocal count
            count += len(points)
            return plain(self, points)

        with monkeypatch.context() as patched:
            patched.setattr(thickness.SampledSurface, "heights", heights)
            advise(simulation)
        asked[spacing] = count
    # Every step along a ray is one; near a surface steps are a part of the spacing, half as long.
    assert 0 < asked["0.01"] < 2 * asked["0.02"]


def test_beside_an_effect_that_does_not_say_what_it_is_for_nothing_is_lacking() -> None:
    flawed = next(one for one in FLAWED if one.name == "sudden-load")
    simulation = built(flawed.toml)

    class Silent:
        answers = None

    assert {one.name for one in advise(simulation)} == {"sudden-load"}
    assert advise(attrs.evolve(simulation, effects={"other": Silent()})) == ()
