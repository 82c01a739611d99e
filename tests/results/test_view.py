"""Views of a record in 3D, drawn without a display, and its pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from solidsph import Record, RecordError, SceneError
from solidsph.maths.arrays import Array
from solidsph.results import view as views
from solidsph.results.view import View
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import box


@pytest.fixture(scope="module", params=[2, 3])
def path(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("view") / "record.h5"
    builder = box(request.param, cells=4).boundary("clamp", where="left").outputs(4)
    builder.initial(velocity={"x": "5*X"}).build().run(record=file)
    return file


def pixels(picture: Path) -> Array:
    return np.asarray(Image.open(picture).convert("RGB"), dtype=float)


def coloured(picture: Path) -> int:
    """Number of pixels that are neither white nor grey or black."""
    rgb = pixels(picture)
    return int((np.ptp(rgb, axis=-1) > 40.0).sum())


def test_the_command_draws_a_picture(path: Path, tmp_path: Path) -> None:
    done = solidsph("view", str(path), "--picture", "body.png", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    # The body covers a good part of the window, in more colours than one.
    assert coloured(tmp_path / "body.png") > 20_000
    options = ("--factor", "5", "--field", "velocity", "--time", "0.005")
    solidsph("view", str(path), "--picture", "more.png", *options, cwd=tmp_path)
    assert np.abs(pixels(tmp_path / "more.png") - pixels(tmp_path / "body.png")).max() > 100.0


def test_body_and_colour_bar_are_whole_and_apart(path: Path, tmp_path: Path) -> None:
    """Nothing reaches the edge of the picture, and between body and bar there is white."""
    with Record(path) as record:
        record.view("velocity", factor=3.0, picture=tmp_path / "body.png")
    white = pixels(tmp_path / "body.png").min(axis=-1) > 250.0
    below_the_caption = white[30:]
    height, width = white.shape
    for edge in (below_the_caption[0], white[-1], white[:, -1], below_the_caption[:, 0]):
        assert edge.all()
    empty = np.flatnonzero(white[height // 4 : -height // 4].all(axis=0))
    assert ((empty > 0.6 * width) & (empty < 0.85 * width)).any()


def test_sliders_move_what_is_shown(path: Path) -> None:
    with Record(path) as record:
        X, d = record.particles.positions, record.dimension
        shown = View(record, "velocity", record.count - 1, 1.0)
        assert np.allclose(shown.cloud.points[:, :d], record.positions[-1], atol=1e-6)  # of float32
        shown.to_factor(3.0)
        expected = X + 3.0 * (record.positions[-1] - X)
        assert np.allclose(shown.cloud.points[:, :d], expected, atol=1e-6)
        shown.to_time(0.0)
        assert np.allclose(shown.cloud.points[:, :d], X, atol=1e-6)
        speeds = np.linalg.norm(record.field("velocity")[0], axis=1)
        assert np.allclose(shown.cloud["colour"], speeds)


def test_what_cannot_be_shown_is_told(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    done = solidsph("view", str(path), cwd=path.parent)
    assert done.returncode == 2
    assert "no display" in done.stderr
    with Record(path) as record, pytest.raises(RecordError, match="no display to open a window on"):
        record.view()
    done = solidsph("view", str(path), "--field", "colour", "--picture", "a.png", cwd=path.parent)
    assert done.returncode == 2
    assert "no field 'colour'" in done.stderr
    done = solidsph("view", str(path), "--factor", "nan", "--picture", "a.png", cwd=path.parent)
    assert done.returncode == 2
    assert "times nan" in done.stderr
    done = solidsph("view", str(path), "--picture", "a.tga", cwd=path.parent)
    assert (done.returncode, "ends in .png" in done.stderr) == (2, True)

    def refuse(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(views, "import_module", refuse)
    with Record(path) as record, pytest.raises(RecordError, match="PyVista is not installed"):
        record.view()


def test_a_result_plots_its_record(tmp_path: Path) -> None:
    simulation = (
        box(2, cells=4).probe(label="end", quantity="displacement", point=[0.8, 0.5]).build()
    )
    result = simulation.run(record=tmp_path / "record.h5")
    for what in ("motion", "energy", "probes"):
        assert isinstance(result.plot(what), Figure)
    with pytest.raises(RecordError, match="take one of motion, energy, probes"):
        result.plot("movie")
    with pytest.raises(SceneError, match="no record to plot"):
        simulation.run().plot()
    plain = box(2, cells=4).build().run(record=tmp_path / "plain.h5")
    with pytest.raises(RecordError, match="has no probe"):
        plain.plot("probes")
