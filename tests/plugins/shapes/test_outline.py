"""Outlines: what drawings say, against closed forms and the libraries that wrote them."""

from __future__ import annotations

import io
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

from solidsph.errors import SceneError
from solidsph.testing import conformance
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.outline import Outline
from solidsph_builtin.shapes.polygon import Polygon
from tests.commands.test_cli import solidsph
from tests.helpers.mesh_bodies import file_scene

SQUARE = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
SLOT = [[0.5, 0.4], [1.5, 0.4], [1.5, 0.6], [0.5, 0.6]]
ISLAND = [[0.9, 0.45], [1.1, 0.45], [1.1, 0.55], [0.9, 0.55]]

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 100 50">
<g transform="translate(1, 2)">
<rect id="plate" x="0" y="0" width="50" height="30"/><circle id="the hole" cx="20" cy="10" r="5"/>
</g>
<path d="M 60 10 C 70 10 70 20 60 20 Z"/>
</svg>"""


def lengths_of(shape: Outline, spacing: float = 0.1) -> dict[str, float]:
    surface = shape.surface(spacing)
    names, sizes = np.array(surface.faces), np.linalg.norm(surface.area_vectors, axis=1)
    return {name: float(sizes[names == name].sum()) for name in sorted(set(surface.faces))}


def drawn(path: Path, units: int = 4) -> Path:
    """A plate with one round end and a hole, in lines and arcs of two layers, backwards and not."""
    drawing = ezdxf.new(units=units)
    space = drawing.modelspace()
    space.add_line((0, 0), (40, 0))
    space.add_line((0, 20), (0, 0))
    space.add_line((0, 20), (40, 20))
    space.add_arc((40, 10), 10, -90, 90, dxfattribs={"layer": "nose"})
    space.add_circle((20, 10), 4, dxfattribs={"layer": "hole 1"})
    space.add_text("not a line")
    drawing.saveas(path)
    return path


def test_what_every_shape_promises() -> None:
    shape = Outline(rings=[SQUARE, SLOT, ISLAND])
    assert [one for one in conformance("shapes", shape) if not one.passed] == []


def test_rings_within_rings_are_holes_and_islands() -> None:
    """However they run and in whatever order; as polygons taken from each other say."""
    shape = Outline(rings=[ISLAND[::-1], SQUARE, SLOT])
    assert shape.volume() == pytest.approx(2.0 - 0.2 + 0.02, rel=1e-14)
    same = Difference(Polygon(SQUARE), Difference(Polygon(SLOT), Polygon(ISLAND)))
    points = np.random.default_rng(0).uniform(-0.5, 2.5, size=(1000, 2))
    inside = shape.signed_distance(points) < 0.0
    assert np.array_equal(inside, same.signed_distance(points) < 0.0)
    near = shape.nearest(points)
    assert np.abs(shape.signed_distance(near)).max() < 1e-14
    distances = np.linalg.norm(near - points, axis=1)
    assert distances == pytest.approx(np.abs(shape.signed_distance(points)), abs=1e-14)


def test_moments_of_a_rectangle_with_a_slot() -> None:
    found = Outline(rings=[SQUARE, SLOT]).moments(np.array([1.0, 0.0]))
    assert found.first == pytest.approx([0.0, 1.0 - 0.1], abs=1e-15)
    across = 2.0 / 3.0 - (0.6**3 - 0.4**3) / 3.0
    assert found.second == pytest.approx(np.diag([8.0 / 12.0 - 0.2 / 12.0, across]), abs=1e-15)


def test_dxf(tmp_path: Path) -> None:
    shape = Outline(drawn(tmp_path / "nose.dxf"), unit="mm")
    area = 800.0 + 50.0 * np.pi - 16.0 * np.pi
    assert shape.volume() == pytest.approx(1e-6 * area, rel=1e-4)
    lengths = lengths_of(shape, 1e-3)
    assert list(lengths) == ["edge-1", "edge-2", "edge-3", "hole-1", "nose"]
    assert lengths["hole-1"] == pytest.approx(8e-3 * np.pi, rel=1e-4)
    assert lengths["nose"] == pytest.approx(10e-3 * np.pi, rel=1e-4)


def test_svg_with_its_transforms(tmp_path: Path) -> None:
    path = tmp_path / "plate.svg"
    path.write_text(SVG)
    shape = Outline(path, unit="mm")
    # A cubic curve with controls 10 aside encloses 3/4 of its box of 10 by 10; times 3/4 along.
    assert shape.volume() == pytest.approx(1e-6 * (1500.0 - 25.0 * np.pi + 60.0), rel=1e-4)
    lower, upper = shape.bounds()
    assert lower == pytest.approx([1e-3, 18e-3], abs=1e-9)  # y upwards, from the bottom edge
    assert upper == pytest.approx([67.5e-3, 48e-3], abs=1e-6)
    assert set(lengths_of(shape, 1e-3)) == {"plate", "the-hole", "edge-1", "edge-2"}
    assert shape.signed_distance(np.array([[21e-3, 38e-3]]))[0] == pytest.approx(5e-3, rel=1e-4)


def test_csv_scaled_turned_and_moved(tmp_path: Path) -> None:
    path = tmp_path / "plate.csv"
    rows = ["\n".join(f"{x}, {y}" for x, y in ring) for ring in (SQUARE, SLOT)]
    path.write_text("# x, y\n" + "\n\n".join(rows))
    shape = Outline(path, unit="cm", scale=10.0, rotate=90.0, translate=[1.0, 0.0])
    assert shape.volume() == pytest.approx(1e-2 * 1.8, rel=1e-13)
    lower, upper = shape.bounds()
    assert (lower, upper) == (pytest.approx([0.9, 0.0]), pytest.approx([1.0, 0.2]))


BROKEN: dict[str, tuple[str, Any, str]] = {
    "open": ("a.dxf", lambda: _dxf([(0, 0), (4, 0), (4, 3)]), r"ends at \(4, 3\),.* 5 away"),
    "gap": ("a.dxf", lambda: _dxf([(0, 0), (4, 0), (4, 3), (0, 0.01)]), "end is 0.01 away"),
    "crossing": ("a.csv", lambda: "0,0\n1,1\n1,0\n0,1.5\n", "two of its edges cross or touch"),
    "touching rings": (
        "a.csv", lambda: "0,0\n1,0\n1,1\n\n1,0.2\n2,0\n2,1\n", "two of its edges cross or touch"
    ),
    "no area": ("a.csv", lambda: "0,0\n1,1\n2,2\n", "encloses no area"),
    "a word": ("a.csv", lambda: "x,y\n0,0\n", "line 1 is 'x,y'; expected two coordinates"),
    "three columns": ("a.csv", lambda: "0,0,0\n", "line 1 is '0,0,0'"),
    "not finite": ("a.csv", lambda: "0,0\n1,nan\n1,1\n", "not finite"),
    "empty": ("a.csv", lambda: "", "it is empty"),
    "no lines": ("a.svg", lambda: "<svg xmlns='http://www.w3.org/2000/svg'/>", "no lines"),
    "no xml": ("a.svg", lambda: "rubbish", "cannot be read as SVG"),
    "no dxf": ("a.dxf", lambda: "rubbish", "be read as DXF|no lines"),
    "bytes": ("a.dxf", lambda: np.random.default_rng(0).bytes(3000), "be read as DXF|no lines"),
    "unit": ("a.dxf", lambda: _dxf([(0, 0), (4, 0), (4, 3), (0, 0)], 4), "set unit = 'mm'"),
    "suffix": ("a.png", lambda: "0", "no drawings end in '.png'; use one of csv, svg, dxf"),
    "entities": (
        "a.svg",
        lambda: "<!DOCTYPE a ["
        + "".join(f'<!ENTITY b{n} "{f"&b{n - 1};" * 10 if n else "x" * 10}">' for n in range(12))
        + "]><svg xmlns='http://www.w3.org/2000/svg'><text>&b11;</text></svg>",
        "cannot be read as SVG",
    ),
}  # fmt: skip


def _dxf(points: list[tuple[float, float]], units: int = 0) -> str:
    drawing = ezdxf.new(units=units)
    for start, end in pairwise(points):
        drawing.modelspace().add_line(start, end)
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()


@pytest.mark.parametrize("name", BROKEN)
def test_broken_drawings(tmp_path: Path, name: str) -> None:
    file, made, message = BROKEN[name]
    content = made()
    data = content if isinstance(content, bytes) else content.encode()
    (tmp_path / file).write_bytes(data)
    (tmp_path / "scene.toml").write_text(file_scene("outline", file))
    result = solidsph("run", "scene.toml", cwd=tmp_path)
    assert result.returncode == 2
    said = " ".join((result.stdout + result.stderr).split())
    assert re.search(message, said), said
    assert said.count("shape 'outline': file") == 1
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "give one of file and rings, got neither"),
        ({"file": "a.csv", "rings": [SQUARE]}, "got both"),
        ({"rings": []}, "there are no rings"),
        ({"rings": [[[0.0, 0.0, 0.0]]]}, "lists of points with two finite coordinates"),
        ({"rings": [SQUARE], "rotate": [1.0, 2.0]}, "rotate must be 1 angle in degrees"),
    ],
)
def test_parameters_that_are_refused(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Outline(**parameters)
