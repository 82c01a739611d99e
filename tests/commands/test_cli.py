"""The command line as a person or a program meets it."""

from __future__ import annotations

import contextlib
import io
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from solidsph.cli import main
from solidsph.registry import registry
from tests.helpers.scenes import SCENE_TOML, box


def solidsph(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """What the command says and returns, in this process: a new one takes a second to import."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    handler = signal.getsignal(signal.SIGTERM)
    with (
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(sys, "argv", ["solidsph", *arguments])
        try:
            main()
        except SystemExit as cause:
            code = int(cause.code or 0)
        finally:
            signal.signal(signal.SIGTERM, handler)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def in_a_process(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The same from a process of its own, in which any warning is an error."""
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "solidsph", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
    )


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "pull.toml"
    path.write_text(SCENE_TOML)
    return path


def test_help_on_every_verb(tmp_path: Path) -> None:
    done = in_a_process("--help", cwd=tmp_path)
    assert done.returncode == 0
    for verb in ("run", "explain", "cases", "plugins", "check", "plot"):
        assert verb in done.stdout
        own = solidsph(verb, "--help", cwd=tmp_path)
        assert own.returncode == 0
        assert "--json" in own.stdout


def test_run_a_scene_then_plot_it(scene: Path) -> None:
    folder = scene.parent
    done = in_a_process("run", str(scene), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "energy residual" in done.stdout
    record = folder / "results/pull/record.h5"
    assert record.exists()
    done = in_a_process("plot", str(record), "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    for picture in json.loads(done.stdout)["pictures"]:
        assert Path(folder / picture).read_bytes().startswith(b"\x89PNG")
    for field in ("volume_ratio", "velocity"):
        done = solidsph("plot", str(record), "--field", field, cwd=folder)
        assert done.returncode == 0, done.stderr
        picture = record.with_name(f"record-{field}.png")
        assert picture.read_bytes().startswith(b"\x89PNG")
    done = solidsph("plot", str(record), "--field", "volumeratio", cwd=folder)
    assert done.returncode == 2
    assert "did you mean 'volume_ratio'? fields: velocity, cauchy_stress" in done.stderr


def test_run_gives_one_json_object(scene: Path) -> None:
    done = solidsph("run", scene.name, "--json", "--output", "here", cwd=scene.parent)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["particles"] == 9 * 5  # those on the surface included
    assert facts["final"]["work of traction right [J]"] > 0.0
    assert (scene.parent / "here/record.h5").exists()


def test_explain_runs_nothing_and_names_what_is_not_simulated(scene: Path) -> None:
    done = solidsph("explain", scene.name, "--json", cwd=scene.parent)
    assert done.returncode == 0, done.stderr
    (facts,) = json.loads(done.stdout)["scenes"].values()
    assert {"kind": "kernel", "name": "modified-mollifier"}.items() <= facts["parts"][0].items()
    effects = {row["effect"]: row["simulated"] for row in facts["effects"]}
    assert effects == dict.fromkeys(registry.names("effects"), False)
    numbers = {row["quantity"]: row["value"] for row in facts["numbers"]}
    assert 1.0 < numbers["critical step over it"] < 4.0
    assert not (scene.parent / "results").exists()
    assert solidsph("explain", scene.name, cwd=scene.parent).returncode == 0


def test_explain_lists_sizes_and_faces(scene: Path) -> None:
    (facts,) = json.loads(solidsph("explain", scene.name, "--json", cwd=scene.parent).stdout)[
        "scenes"
    ].values()
    sizes = {r["quantity"]: r["value"] for r in facts["numbers"] if "size" in r["quantity"]}
    assert sizes == {"size of block [m]": "1 x 0.5"}
    faces = {row.pop("face"): row for row in facts["faces"]}
    assert set(faces) == {"left", "right", "bottom", "top"}
    assert faces["top"]["area"] == pytest.approx(1.0)
    assert faces["top"]["centre"] == pytest.approx([0.5, 0.5], abs=0.07)  # half a spacing inside
    shown = solidsph("explain", scene.name, cwd=scene.parent).stdout
    assert "length [m]" in shown
    assert "centre [m]" in shown


def test_internals_are_shown_on_request_only(scene: Path) -> None:
    for verb, internals in (
        ("explain", ("MatrixForces", "time loop", "bytes held", "bytes touched in all", "arrays")),
        ("run", ("bytes touched",)),
    ):
        brief = solidsph(verb, scene.name, cwd=scene.parent)
        verbose = solidsph(verb, scene.name, "--verbose", cwd=scene.parent)
        assert brief.returncode == verbose.returncode == 0, brief.stderr + verbose.stderr
        facts = solidsph(verb, scene.name, "--json", cwd=scene.parent).stdout
        for word in internals:
            assert word not in brief.stdout
            assert word in verbose.stdout
            assert word in facts


def test_cases_and_plugins(tmp_path: Path) -> None:
    cases = json.loads(solidsph("cases", "--json", cwd=tmp_path).stdout)["cases"]
    assert "tensile-instability" in [case["case"] for case in cases]
    plugins = json.loads(solidsph("plugins", "--load", "--json", cwd=tmp_path).stdout)["plugins"]
    assert len(plugins) > 35
    assert {plugin["status"] for plugin in plugins} == {"ok"}
    assert "wendland-c2" in [plugin["name"] for plugin in plugins]
    assert solidsph("plugins", cwd=tmp_path).returncode == 0
    assert solidsph("cases", cwd=tmp_path).returncode == 0


def test_check_certifies_a_third_partys_kernel(tmp_path: Path) -> None:
    done = solidsph("check", "wendland-c2", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["passed"]
    assert facts["distribution"].startswith("solidsph-wendland")


def test_check_shows_a_badge_for_every_part_of_a_kind(tmp_path: Path) -> None:
    done = solidsph("check", "--all", "--kind", "divergence", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["passed"]
    badges = {row["part"]: row for row in facts["parts"]}
    assert set(badges) == {"plain", "variational"}
    assert all(row["passed"] == row["checks"] > 1 for row in badges.values())
    told = solidsph("check", "--all", "--kind", "divergence", cwd=tmp_path).stdout
    assert "all certified" in told


def test_check_certifies_a_scheme(tmp_path: Path) -> None:
    scheme = ("--gradient", "difference", "--divergence", "plain", "--cover", "2.5")
    done = solidsph("check", *scheme, "--stretch", "1.2,1", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["passed"], facts["dimension"], facts["stretches"]) == (True, 2, [1.2, 1.0])
    assert len(facts["zero_energy_waves"]) == 3

    scheme = (*scheme, "--formulation", "updated-lagrangian")
    done = solidsph("check", *scheme, "--stretch", "1.1", "--dimension", "1", "--run", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "tensile instability" in done.stdout
    assert "confirmed by runs" in done.stdout
    assert "NOT certified" in done.stdout


def test_check_takes_a_cases_scheme_with_hourglass_control_added(tmp_path: Path) -> None:
    case = ("check", "--scheme", "tensile-instability", "--set", "cover=3.0", "--dimension", "1")
    done = solidsph(*case, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "cover 3," in done.stdout
    assert "total-lagrangian, modified-mollifier, difference gradient" in done.stdout
    assert "hourglass-control resists them" in done.stdout
    controlled = solidsph(*case, "--hourglass", "0.5", cwd=tmp_path).stdout
    assert "none beyond translations" in controlled


def test_stability_draws_a_map(tmp_path: Path) -> None:
    arguments = ("--gradient", "difference", "--divergence", "plain", "--points", "6", "4")
    done = solidsph("stability", "--map", *arguments, "--output", "maps", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    total, updated = json.loads(done.stdout)["maps"]
    assert total["unstable_in_tension"] == total["unstable_in_compression"] == 0.0
    assert updated["unstable_in_tension"] > 0.5
    assert (tmp_path / "maps/map.png").stat().st_size > 20_000


def test_write_a_cases_scenes_and_run_one(tmp_path: Path) -> None:
    done = solidsph(
        "run", "tensile-instability", "--set", "stretches=[]", "--write", "scene.toml", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    written = sorted(path.name for path in tmp_path.glob("*.toml"))
    assert written == ["scene-total-lagrangian.toml", "scene-updated-lagrangian.toml"]
    assert solidsph("run", written[0], cwd=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("run", "absent.toml"), "cannot be read"),
        (("run", "folder/absent"), "no file"),
        (("run", "tensile-instabilty"), "did you mean 'tensile-instability'"),
        (("run", "tensile-instability", "--set", "strech=1.2"), "did you mean 'stretch'"),
        (("run", "tensile-instability", "--set", "stretch"), "not of the form name=value"),
        (("run", "tensile-instability", "--set", "stretch=wide"), "stretch must be a number"),
        (("run", "tensile-instability", "--set", "stretch=1"), "must be positive and not 1"),
        (("run", "pull.toml", "--set", "a=1"), "no such word of a scene"),
        (("run",), "missing argument"),
        (("fly",), "no such command"),
        (("check", "wendland"), "did you mean 'wendland-c2'"),
        (("check", "modified-mollifier", "--kind", "colour"), "unknown kind"),
        (("check",), "nothing to check"),
        (("check", "wendland-c2", "--cover", "3"), "check one at a time"),
        (("check", "--all", "--cover", "3"), "leave out the name"),
        (("check", "--all", "--kind", "colour"), "kinds with a kit"),
        (("check", "--cover", "3", "--stretch", "wide"), "is no number"),
        (("check", "--cover", "0.5"), "too small in 2D"),
        (("check", "--cover", "3", "--set", "a=1"), "name one"),
        (("plot", "absent.h5"), "absent.h5"),
    ],
)
def test_bad_input_is_one_message_and_code_2(
    scene: Path, arguments: tuple[str, ...], expected: str
) -> None:
    done = solidsph(*arguments, cwd=scene.parent)
    assert done.returncode == 2, done.stdout + done.stderr
    assert expected in done.stderr
    assert "Traceback" not in done.stderr


def test_a_diverging_run_is_code_1_and_its_record_can_be_plotted(scene: Path) -> None:
    text = SCENE_TOML.replace(
        'type = "clamp"\nwhere = "left"',
        'type = "prescribed-motion"\nwhere = "left"\ndisplacement = {x = "300*t", y = 0}',
    )
    scene.write_text(text.replace("outputs = 5", "outputs = 100"))
    done = solidsph("run", scene.name, cwd=scene.parent)
    assert done.returncode == 1
    assert "diverged at step" in done.stderr
    assert "J = " in done.stderr
    assert "Traceback" not in done.stderr
    done = solidsph("plot", "results/pull/record.h5", cwd=scene.parent)
    assert done.returncode == 0, done.stderr


def test_an_output_folder_that_cannot_be_made(scene: Path) -> None:
    (scene.parent / "blocked").write_text("a file, not a folder")
    done = solidsph("run", scene.name, "--output", "blocked", cwd=scene.parent)
    assert done.returncode == 2
    assert "blocked" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_large_scene_is_explained_without_building_it(tmp_path: Path) -> None:
    text = SCENE_TOML.replace("spacing = 0.125", "spacing = 2.2e-4")
    (tmp_path / "large.toml").write_text(text)
    done = solidsph("explain", "large.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["scenes"]["large.toml"]
    assert told["on paper"]
    numbers = {row["quantity"]: row["value"] for row in told["numbers"]}
    assert numbers["particles"] == pytest.approx(0.5 / 2.2e-4**2, rel=0.01)  # 1e7
    (tmp_path / "small.toml").write_text(SCENE_TOML)
    done = solidsph("explain", "small.toml", "--json", cwd=tmp_path)
    assert not json.loads(done.stdout)["scenes"]["small.toml"]["on paper"]


def test_the_shell_completes_verbs_options_and_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def completed(*words: str) -> list[str]:
        monkeypatch.setenv("COMP_WORDS", " ".join(["solidsph", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        done = in_a_process(cwd=tmp_path)
        return [line.partition(",")[2] for line in done.stdout.splitlines()]

    monkeypatch.setenv("_SOLIDSPH_COMPLETE", "bash_complete")
    assert completed("co") == ["cost"]
    assert completed("run", "--acc") == ["--accuracy"]
    assert completed("cost", "csm") == ["csm1", "csm3", "csm"]  # the last: files of that name


def test_plot_and_view_take_the_folder_of_a_record(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    box(2).build().run(record=folder / "record.h5")
    assert solidsph("plot", "one", cwd=tmp_path).returncode == 0
    assert (folder / "record-motion.png").is_file()
    box(2).build().run(record=folder / "other.h5")
    several = solidsph("view", "one", cwd=tmp_path)
    assert several.returncode == 2
    assert "several records (other.h5, record.h5)" in several.stderr
    nothing = solidsph("plot", ".", cwd=tmp_path)
    assert nothing.returncode == 2
    assert "there is no record" in nothing.stderr
