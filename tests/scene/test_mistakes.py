"""Several mistakes in one message, files as other programs write them, scenes beyond measure."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import solidsph.scene.default_cover
from solidsph import Scene, Simulation, cli
from solidsph.commands.target import resolve
from solidsph.commands.verbosity import say_from
from solidsph.costs import memory_check
from solidsph.costs.estimate import estimate_work
from solidsph.errors import BuildError, SceneError
from solidsph.registry.construct import construct
from solidsph.registry.problems import MOST_OF_A_KIND, Problems
from solidsph.scene.checks import geometry
from solidsph.studies.scene_words import changed as in_words
from solidsph_builtin.materials.neo_hookean import NeoHookean
from tests.helpers.scenes import SCENE_TOML, box


def message_of(text: str) -> str:
    with pytest.raises((SceneError, BuildError)) as caught:
        Simulation.builder(Scene.from_toml(text)).build()
    return str(caught.value)


def changed(*changes: tuple[str, str]) -> str:
    text = SCENE_TOML
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


UNKNOWN_MATERIAL = ("neo-hookean", "neo-hokean"), "unknown material 'neo-hokean'"
MISSING = ('traction = {x = "1e3*min(t/0.005, 1)"}', ""), "missing parameter 'traction'"
TAG = ('where = "left"', 'where = "lift"'), "where = 'lift' is neither a tag"
KEY = ("outputs = 5", "outptus = 5"), "unknown key 'outptus'"
TYPE = ("cover = 3.0", 'cover = "3"'), "kernel.cover must be a number"
EFFECT = ("[integrator]", '[[effect]]\ntype = "gravity"\n[integrator]'), "unknown effect 'gravity'"
EMPTY = (
    ("[integrator]", '[[initial]]\nwhere = "X > 9"\n[integrator]'),
    "where = 'X > 9' matches no particle",
)
STEP = ('type = "central-difference"', "time_step = -1.0"), "time_step must be positive"
SPACING = ("spacing = 0.125", 'spacing = "fine"'), "unknown name 'fine'"
SHAPE = ('type = "box"', 'type = "boxx"'), "unknown shape 'boxx'"
NAME = ('title = "a block', 'engine = "steam"\ntitle = "a block'), "unknown engine 'steam'"


@pytest.mark.parametrize(
    "mistakes",
    [
        (UNKNOWN_MATERIAL, MISSING, TAG),
        (KEY, TYPE, EFFECT),
        (UNKNOWN_MATERIAL, MISSING, TAG, KEY, TYPE, EFFECT, NAME),
        (TAG, EMPTY, KEY),
        (STEP, TAG),
        (EMPTY, EFFECT),
        (SPACING, SHAPE, UNKNOWN_MATERIAL),
    ],
)
def test_all_mistakes_are_one_message(mistakes: tuple[tuple[tuple[str, str], str], ...]) -> None:
    message = message_of(changed(*(change for change, _ in mistakes)))
    for _, expected in mistakes:
        assert message.count(expected) == 1
    assert message.count("\n  - ") == len(mistakes)  # and nothing that follows from another


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        ('[[effect]]\ntype = "body-force"\nacceleration = {y = "-9.81*foo"}', "unknown name 'foo'"),
        ('[[effect]]\ntype = "body-force"\nacceleration = {y = -9.81, q = 1}', "component 'q'"),
        ('[[initial]]\nvelocity = {x = "sin("}', "'sin(' cannot be read"),
        ('[[boundary]]\ntype = "pressure"\nwhere = "top"\npressure = "1 +"', "'1 +' cannot be"),
        (
            '[[boundary]]\ntype = "traction"\nwhere = "top"\ntraction = {x = "u", y = "v"}',
            "unknown name 'v'",
        ),
        (
            '[[boundary]]\ntype = "traction"\nwhere = "top"\ntraction = {x = nan}',
            "expected a finite number, got nan",
        ),
        (
            '[[effect]]\ntype = "heat"\nconductivity = 1\nheat_capacity = 1\nsource = "Q"',
            "unknown name 'Q'",
        ),
    ],
)
def test_formulas_that_cannot_be_read_are_told_with_all_else(extra: str, told: str) -> None:
    # Formulas are needed long after materials; still, nobody should have to come twice.
    message = message_of(
        changed(UNKNOWN_MATERIAL[0], TAG[0], ("[integrator]", f"{extra}\n[integrator]"))
    )
    for one in (UNKNOWN_MATERIAL[1], TAG[1], told):
        assert one in message
    assert message.count(told) == 1


def test_all_wrong_values_of_a_material_are_told() -> None:
    message = message_of(
        changed(
            ("youngs_modulus = 1e6", "youngs_modulus = 0"),
            ("poissons_ratio = 0.3", "poissons_ratio = 0.5"),
            ("density = 1000.0", "density = -1"),
        )
    )
    for name in ("youngs_modulus", "poissons_ratio", "density"):
        assert f"{name} must" in message


@pytest.mark.parametrize("name", ["duration", "outputs", "cover", "time_step", "time_step_factor"])
@pytest.mark.parametrize("value", ["fast", [1.0], True])
def test_a_number_of_the_wrong_type_by_its_word_is_told(name: str, value: Any) -> None:
    # A file is read by type; what --set, an axis or the builder give comes another way.
    with pytest.raises(BuildError, match=f"{name} must be .*got {re.escape(repr(value))}"):
        Simulation.builder(in_words(Scene.from_toml(SCENE_TOML), name, value)).build()


def test_a_mistyped_key_is_not_missing_as_well() -> None:
    message = message_of(changed(("spacing = 0.125", "spacng = 0.125"), ("density", "densty")))
    assert "did you mean 'spacing'" in message
    assert "did you mean 'density'" in message
    assert "no spacing" not in message
    assert "missing" not in message


def test_what_names_a_tag_that_is_wrong_is_not_wrong_too() -> None:
    text = changed(("spacing = 0.125", 'spacing = 0.125\ntags = {mid = "X > Q"}'))
    assert message_of(text.replace('"left"', '"mid"')).count("\n  - ") == 1


def test_mistakes_of_one_part_are_one_line() -> None:
    with pytest.raises(SceneError) as caught:
        construct("materials", {"type": "neo-hookean", "density": "x", "colour": 1})
    for expected in ("unknown parameter 'colour'", "'youngs_modulus', 'poissons_ratio'", "number"):
        assert expected in str(caught.value)


# Many mistakes


def test_of_many_problems_of_a_kind_the_first_are_told_and_the_rest_counted() -> None:
    problems = Problems()
    problems.add(f"body {k!r} of 'b{k}' is {k}.5e-3 m long" for k in range(1000))
    problems.add(["something else"])
    assert len(problems.found) == MOST_OF_A_KIND + 2
    assert f"and {1000 - MOST_OF_A_KIND} more of this kind" in problems.found
    problems.add(["x" * 10**6])
    assert max(map(len, problems.found)) < 2000


def test_equal_clamps_are_told_of_once_each_and_not_in_pairs() -> None:
    scene = box(2, 4)
    for _ in range(60):
        scene.boundary("clamp", where="left")
    with pytest.raises(BuildError) as caught:
        scene.build()
    assert len(caught.value.problems) == MOST_OF_A_KIND + 1
    assert caught.value.problems[-1] == "and 49 more of this kind"  # 59 beside the first
    assert len(str(caught.value)) < 4000


def test_many_mistyped_names_are_one_short_message() -> None:
    scene = box(1, 4)
    for k in range(300):
        scene.boundary("clamp", where=f"lef{k}")
    with pytest.raises(BuildError) as caught:
        scene.build()
    assert len(str(caught.value)) < 4000


# Files


@pytest.mark.parametrize(
    "data",
    [
        b"\xef\xbb\xbf" + SCENE_TOML.encode(),
        SCENE_TOML.replace("\n", "\r\n").encode(),
        b"\xef\xbb\xbf" + SCENE_TOML.replace("\n", "\r\n").encode(),
        SCENE_TOML.replace("\n", "\r").encode(),
    ],
)
def test_a_scene_as_other_editors_write_it(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(data)
    assert Scene.read(tmp_path / "scene.toml") == Scene.from_toml(SCENE_TOML)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (SCENE_TOML.encode("utf-16"), "UTF-16"),
        (SCENE_TOML.encode("utf-16-le"), "UTF-16"),
        ('title = "Träger"'.encode("latin-1"), "is not in UTF-8"),
        (b"", "is empty"),
        (b"\xef\xbb\xbf \r\n", "is empty"),
    ],
)
def test_a_scene_that_is_no_text_in_utf_8(data: bytes, expected: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(data)
    with pytest.raises(SceneError, match=expected):
        Scene.read(tmp_path / "scene.toml")


def test_a_name_that_is_wrong_is_told_the_nearest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beam.toml").write_text(SCENE_TOML)
    for wrong, right in (
        ("baem.toml", "beam.toml"),
        ("beem", "beam.toml"),
        (str(tmp_path / "bem.toml"), "beam.toml"),
        ("wave-ber", "wave-bar"),
    ):
        with pytest.raises(SceneError) as caught:
            resolve(wrong, ())
        assert f"{right}'" in str(caught.value)
        assert len(str(caught.value)) < 300
    with pytest.raises(SceneError, match=r"is a folder; give a scene file, such as 'beam.toml'"):
        resolve(".", ())
    with pytest.raises(SceneError, match="unknown case 'qqq'; give a scene file, or a case"):
        resolve("qqq", ())


def test_a_scene_from_the_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(SCENE_TOML.encode())))
    assert resolve("-", ()) == Scene.from_toml(SCENE_TOML)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"duration = ")))
    with pytest.raises(SceneError, match="the standard input is not valid TOML"):
        resolve("-", ())


POINTS = "0.25,0.25\n0.75,0.25\n0.25,0.75\n0.75,0.75\n"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("POINTS.CSV", POINTS.encode()),
        ("points.csv", b"\xef\xbb\xbf" + POINTS.encode()),
        ("points.Csv", b"\xef\xbb\xbf# x, y\r\n" + POINTS.replace("\n", "\r\n").encode()),
        ("points.txt", b"\xef\xbb\xbf" + POINTS.replace(",", " ").encode()),
    ],
)
def test_points_as_other_programs_write_them(name: str, data: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    square = construct("shapes", {"type": "box", "lengths": [1.0, 1.0]})
    points = construct("discretisations", {"type": "points", "file": str(tmp_path / name)})
    found = points.particles(square, 0.5).positions
    assert found.tolist() == [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]


@pytest.mark.parametrize("header", ["x,y", "x [m],y [m]", "Points:0,Points:1"])
def test_a_header_of_points_is_named(header: str, tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text(f"{header}\n{POINTS}")
    square = construct("shapes", {"type": "box", "lengths": [1.0, 1.0]})
    points = construct("discretisations", {"type": "points", "file": str(tmp_path / "points.csv")})
    with pytest.raises(SceneError) as caught:
        points.particles(square, 0.5)
    assert f"its first line {header!r} is not a row of numbers" in str(caught.value)
    assert "begin a header with '#'" in str(caught.value)


def test_a_ring_of_vertices_may_be_closed() -> None:
    ring = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
    for corners in (ring, ring[::-1], ring[1:] + ring[:1], ring[:3]):
        opened, closed = (
            construct("shapes", {"type": "polygon", "vertices": one})
            for one in (corners, [*corners, corners[0]])
        )
        assert closed == opened


# Many bodies


def test_the_cover_of_a_scene_is_found_once_whatever_its_bodies(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []
    ratio = solidsph.scene.default_cover.wave_number_ratio
    monkeypatch.setattr(
        solidsph.scene.default_cover,
        "wave_number_ratio",
        lambda *one: asked.append(one[2]) or ratio(*one),
    )

    def times(bodies: int) -> int:
        scene = Simulation.builder().material(
            "neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3
        )
        for k in range(bodies):
            scene.body(
                f"b{k}", shape={"type": "interval", "length": 1.0, "origin": 2.0 * k}, spacing=0.1
            )
        asked.clear()
        estimate_work(scene.duration(1e-3).scene())
        scene.build()
        return len(asked)

    assert times(5) == times(1)


def test_of_many_bodies_in_one_place_few_pairs_are_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked: list[object] = []
    overlap = geometry.overlap
    monkeypatch.setattr(geometry, "overlap", lambda *one: looked.append(one) or overlap(*one))
    scene = Simulation.builder().material(
        "neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3
    )
    for k in range(30):  # 435 pairs
        scene.body(f"b{k}", shape={"type": "box", "lengths": [1.0, 1.0]}, spacing=0.5)
    with pytest.raises(BuildError) as caught:
        scene.duration(1e-3).build()
    assert str(caught.value).count("are in one place") == MOST_OF_A_KIND == len(looked)
    assert "425 more pairs of bodies" in str(caught.value)


# Memory


def large(spacing: float, **body: object) -> Scene:
    return (
        Simulation.builder()
        .body("b", shape={"type": "box", "lengths": [1.0] * 3}, spacing=spacing)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3)
        .duration(1e-3)
        .scene()
    )


def test_a_scene_that_needs_more_memory_than_is_free_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(memory_check, "available_memory", lambda: 2**30)
    with pytest.raises(SceneError) as caught:
        memory_check.check_memory(large(0.004))
    # (1 / 0.004)^3 = 1.56e7 particles; 1 GiB is free.
    for expected in ("1.56e+07 particles", "only 1 GiB are free", "the spacing", "--beyond-memory"):
        assert expected in str(caught.value)
    memory_check.check_memory(large(0.05))  # 8000 particles fit
    monkeypatch.setattr(memory_check, "available_memory", lambda: 2**50)
    memory_check.check_memory(large(0.004))


def test_what_is_wrong_is_left_to_the_build(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_check, "available_memory", lambda: 0)
    memory_check.check_memory(
        Simulation.builder(large(0.004)).kernel("no-such").material("no-such").scene()
    )


# Standard streams


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        cwd=folder,
        env=os.environ | {"RUN": f"{sys.executable} -m solidsph run"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "command",
    [
        "$RUN scene.toml --quiet | head -1",
        pytest.param("$RUN scene.toml --json | head -1", marks=pytest.mark.validation),
        pytest.param("$RUN scene.toml --quiet >&-", marks=pytest.mark.validation),
        "$RUN - --quiet < scene.toml <&- 2>&- >&-; test $? = 2 && $RUN - < scene.toml",
    ],
)
def test_a_reader_that_goes_away_fails_no_run(command: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE_TOML)
    done = shell(command, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    assert list(tmp_path.glob("results/*/record.h5"))


def test_a_warning_is_told_without_path_and_source(capsys: pytest.CaptureFixture[str]) -> None:
    say_from(verbose=0, quiet=False)  # as every verb does
    cli._show_warning(UserWarning("few neighbours"), UserWarning, "/some/where.py", 7)
    assert capsys.readouterr().err == "warning: few neighbours\n"
    cli._show_warning(RuntimeWarning("overflow"), RuntimeWarning, "/some/where.py", 7)
    assert "/some/where.py:7" in capsys.readouterr().err  # not about the input: it says where


def test_check_says_how_to_give_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(NeoHookean, "example", {"density": 1.0})
    with pytest.raises(SceneError, match="such as --set youngs_modulus="):
        cli.cli.main(["check", "neo-hookean"], standalone_mode=False)
