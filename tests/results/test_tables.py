"""Records as tables and datasets, and what notebooks show of results."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas
import pytest
import xarray

from solidsph import Record, RecordError, Simulation
from solidsph.results import tables
from solidsph.results.error_bars import ErrorBar, write_error_bars
from solidsph.studies.certificate import certificate
from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point
from solidsph.studies.scheme import Scheme
from solidsph.studies.search import SearchResult
from solidsph.system import html
from tests.helpers.scenes import box


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("tables") / "record.h5"
    builder = box(2, tags={"low": "Y < 0.4"}).boundary("clamp", where="left").outputs(4)
    builder = builder.initial(velocity={"x": "X"})
    builder = builder.probe(label="end", quantity="displacement", point=[0.9, 0.5])
    builder.build().run(record=file)
    return file


def test_displacement_is_a_field_of_every_record(path: Path) -> None:
    with Record(path) as record:
        u = record.field("displacement")
        assert u.shape == record.positions.shape
        assert u.unit == "m"
        assert np.array_equal(u[-1], record.positions[-1] - record.particles.positions)
        assert np.array_equal(np.asarray(u)[2], u[2])


def test_the_history_is_a_table(path: Path) -> None:
    with Record(path) as record:
        table = record.to_pandas()
        assert isinstance(table, pandas.DataFrame)
        assert list(table.columns) == list(record.history)
        assert np.array_equal(table.index, record.times)
        column = "end displacement x [m]"
        assert np.array_equal(table[column], record.history[column])


def test_a_record_is_a_dataset(path: Path) -> None:
    with Record(path) as record:
        data = record.to_xarray()
        some = record.to_xarray(["displacement"], slice(-1, None))
        assert isinstance(data, xarray.Dataset)
        assert dict(data.sizes) == {"time": 5, "particle": 36, "axis": 2, "axis_2": 2}
        assert np.array_equal(data["cauchy_stress"][3], record.field("cauchy_stress")[3])
        assert data["cauchy_stress"].attrs["units"] == "Pa"
        assert data["cauchy_stress"].dims == ("time", "particle", "axis", "axis_2")
        assert data["volume_ratio"].attrs["units"] == "1"
        assert data["end_displacement_x"].attrs == {
            "long_name": "end displacement x",
            "units": "m",
        }
        # Chosen by labels, as xarray is used.
        right = data.where(data.X > 0.9, drop=True)
        assert right.sizes["particle"] == 6
        low = data["tag_low"].to_numpy()
        assert np.array_equal(low, record.particles.tags["low"])
        assert set(data["body"].to_numpy()) == {"block"}
        assert "cauchy_stress" not in some
        assert some.sizes["time"] == 1
        assert np.array_equal(
            some["displacement"][0], record.positions[-1] - record.particles.positions
        )
        with pytest.raises(RecordError, match="did you mean 'velocity'"):
            record.to_xarray(["velocty"])


def test_a_dataset_is_written_and_read(path: Path, tmp_path: Path) -> None:
    with Record(path) as record:
        data = record.to_xarray()
        data.to_netcdf(tmp_path / "run.nc", engine="scipy")
    with xarray.open_dataset(tmp_path / "run.nc", engine="scipy") as again:
        assert np.array_equal(again["velocity"], data["velocity"])


def test_what_is_not_installed_is_told(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(tables, "import_module", refuse)
    with Record(path) as record:
        with pytest.raises(RecordError, match=r"pandas is not installed; run: pip install"):
            record.to_pandas()
        with pytest.raises(RecordError, match=r"xarray is not installed; run: pip install"):
            record.to_xarray()


class Cells(HTMLParser):
    """Checks that elements close, and collects their texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def shown(thing: object) -> list[str]:
    return Cells(thing._repr_html_()).texts  # type: ignore[attr-defined]


def test_what_notebooks_show(path: Path, tmp_path: Path) -> None:
    simulation = box(2).probe(label="end", quantity="displacement", point=[0.9, 0.5]).build()
    texts = shown(simulation)
    assert {"block", "box", "36", "end", "modified-mollifier", "neo-hookean"} <= set(texts)
    result = simulation.run(record=tmp_path / "r.h5")
    texts = shown(result)
    assert "end displacement x [m]" in texts
    assert str(tmp_path / "r.h5") in texts
    write_error_bars(tmp_path / "r.h5", {"final end displacement x [m]": ErrorBar(1.5, 0.02)})
    with Record(tmp_path / "r.h5") as record:
        texts = shown(record)
        assert "1.5 +- 0.02" in texts
        assert record.error_bars["final end displacement x [m]"] == ErrorBar(1.5, 0.02)
    point = Point({"spacing": 0.1}, 0.01, seconds=(2.0,))
    assert "spacing 0.1" in shown(Frontier([point], "spacing"))
    assert "yes" in shown(SearchResult(point, [point], "one tried"))
    assert "Certificate" in shown(certificate(Scheme(), 1))
    static = Simulation.builder(simulation.scene).statics().boundary("clamp", where="left").build()
    assert "load steps" in shown(static)


def test_texts_cannot_be_markup() -> None:
    text = html.heading("<b>", "a & b") + html.of_values({"<i>": "<script>"})
    assert not re.search(r"<script|<i>", text)
    assert Cells(text).texts == ["<b>", "a & b", "<i>", "<script>"]
    assert html.of_rows([]) == ""
