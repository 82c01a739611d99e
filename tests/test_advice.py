"""Warnings ahead of a run: each flaw is named with its remedy, and a sound scene hears nothing."""

from __future__ import annotations

import json
import sys
import tomllib
import tracemalloc
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import attrs
import pytest

from solidsph import BuildError, Scene, SceneError, Simulation
from solidsph.advice import ADVICE, Advice, advised, catalogue
from solidsph.advice.seen import Seen
from tests.advised_scenes import FLAWED, SOUND, Flawed
from tests.scenes import SCENE_TOML
from tests.test_cli import solidsph


@cache
def built(toml: str) -> Simulation:
    """By the engine that compiles nothing: no warning is about engines."""
    return Simulation.builder(Scene.from_toml(toml)).engine("matrix").build()


def heard(toml: str) -> tuple[Advice, ...]:
    return advised(built(toml))


def title(toml: str) -> str:
    text: str = tomllib.loads(toml)["title"]
    return text


@pytest.mark.parametrize("flawed", FLAWED, ids=[title(one.toml) for one in FLAWED])
def test_a_flaw_is_named_and_nothing_else(flawed: Flawed) -> None:
    found = heard(flawed.toml)
    assert {one.name for one in found} == {flawed.name}
    assert flawed.remedy in found[0].remedy
    assert found[0].found
    assert found[0].expected


@pytest.mark.parametrize("toml", SOUND, ids=title)
def test_a_sound_scene_hears_nothing(toml: str) -> None:
    assert [one.line for one in heard(toml)] == []


def test_every_warning_has_a_flawed_scene() -> None:
    assert {one.name for one in FLAWED} == set(ADVICE)
    assert len(SOUND) >= 12


@pytest.mark.parametrize("toml", [*(one.toml for one in FLAWED), *SOUND], ids=title)
def test_no_warning_fails_where_it_could_be_formed(toml: str) -> None:
    """`advised` leaves out what fails; here it would show."""
    seen = Seen(built(toml))
    for look in ADVICE.values():
        list(look(seen))


def test_a_warning_that_fails_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(seen: Seen) -> Iterator[Advice]:
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
    assert advised(Simulation.builder(said).build()) == ()


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
    done = solidsph("run", "blow.toml", "--quiet", cwd=tmp_path)
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


def test_it_is_cheap_beside_building() -> None:
    """On a block of four thousand particles, by what does not depend on the machine.

    A twelfth of the calls of functions of the build and a thirtieth of the bytes at the peak; room
    is left for more warnings.
    """
    toml = next(one for one in SOUND if "pressed in space" in one).replace("0.0125", "0.00625")
    toml = toml.replace("hourglass-control", 'mass-damping"\nrate = 2.0 #')  # compiles nothing
    advised(built(toml))  # what is found once is found
    for work, share in ((calls, 0.2), (peak_bytes, 0.1)):
        assert work(lambda: advised(built(toml))) < share * work(lambda: built.__wrapped__(toml))


def calls(act: Callable[[], object]) -> int:
    """Of functions, Python's own and compiled ones."""
    count = 0

    def profile(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        act()
    finally:
        sys.setprofile(before)
    return count


def peak_bytes(act: Callable[[], object]) -> int:
    """Of arrays and objects that are held at once, beyond those held before."""
    tracemalloc.start()
    try:
        act()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_beside_an_effect_that_does_not_say_what_it_is_for_nothing_is_lacking() -> None:
    flawed = next(one for one in FLAWED if one.name == "sudden-load")
    simulation = built(flawed.toml)

    class Silent:
        answers = None

    assert {one.name for one in advised(simulation)} == {"sudden-load"}
    assert advised(attrs.evolve(simulation, effects={"other": Silent()})) == ()
