"""A notebook as a newcomer has it, executed: what its cells show."""

from __future__ import annotations

import base64
import io
from typing import Any

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

from tests.helpers.waiting import HANG

BUILD = """
from solidsph import Record, Simulation
from solidsph.studies.cost import SweepSetup, frontier
from solidsph.studies.processes import Processes

simulation = (
    Simulation.builder()
    .title("a pulled square")
    .body("square", shape={"type": "box", "lengths": [1.0, 1.0]}, spacing=0.125)
    .material("linear-elastic", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
    .boundary("clamp", where="left")
    .boundary("traction", where="right", traction={"x": "1e3*min(t/0.01, 1)"})
    .probe(label="end", quantity="displacement x", point=[1.0, 0.5])
    .duration(0.02)
    .outputs(200)
    .build()
)
simulation
"""

CELLS = {
    "simulation": BUILD,
    "run": """result = simulation.run(record="square.vtkhdf")""",
    "silent": """simulation.run(progress=False);""",
    "result": "result",
    "record": """record = Record("square.vtkhdf"); record""",
    "pandas": "record.to_pandas()",
    "xarray": "record.to_xarray()",
    "plot": "result.plot()",
    "probes": """record.plot("probes")""",
    "view": """record.view(picture="body.png")
from IPython.display import Image
Image("body.png")""",
    "window": "record.view()",
    "sweep": """
both = SweepSetup(Processes(2))
made = frontier(simulation.scene, {"spacing": [0.25, 0.177, 0.125]}, both)
""",
    "frontier": "made",
    "failure": """
class Stop:
    from solidsph.run.hooks import implementation
    @implementation
    def solidsph_step_end(self, observation):
        if observation.state.time > 0.005:
            raise ZeroDivisionError("for the test")
simulation.run(observers=[Stop()])
""",
}

Outputs = dict[str, list[dict[str, Any]]]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Outputs:
    """What each cell shows."""
    cells = [nbformat.v4.new_code_cell(source) for source in CELLS.values()]
    notebook = nbformat.v4.new_notebook(cells=cells)
    where = {"metadata": {"path": str(tmp_path_factory.mktemp("notebook"))}}
    client = NotebookClient(
        notebook, timeout=HANG, kernel_name="python3", resources=where, allow_errors=True
    )
    client.execute()
    shown = {name: cell["outputs"] for name, cell in zip(CELLS, notebook.cells, strict=True)}
    errors = [(n, o["evalue"]) for n, all_ in shown.items() for o in all_ if "evalue" in o]
    assert [name for name, _ in errors] == ["failure"], errors
    return shown


def page(outputs: Outputs, name: str) -> str:
    """The HTML that a cell shows, once."""
    (html,) = [o["data"]["text/html"] for o in outputs[name] if "text/html" in o.get("data", {})]
    return str(html)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("simulation", ("a pulled square", "linear-elastic", "particles", "81", "outputs")),
        ("result", ("Result", "wall time [s]", "square.vtkhdf", "end displacement x [m]")),
        ("record", ("Record square.vtkhdf", "finished", "displacement, velocity")),
        ("pandas", ("<table", "end displacement x [m]", "kinetic energy [J]")),
        ("xarray", ("xarray.Dataset", "cauchy_stress", "particle")),
        ("frontier", ("The front, of 3 configurations", "spacing 0.125", "error [%]")),
    ],
)
def test_results_show_themselves_as_tables(
    outputs: Outputs, name: str, words: tuple[str, ...]
) -> None:
    shown = page(outputs, name)
    for word in words:
        assert word in shown
    for output in outputs[name]:  # where no HTML is shown, as on a terminal
        if name not in ("pandas", "xarray", "frontier"):
            assert len(output["data"]["text/plain"]) < 100


@pytest.mark.parametrize("name", ["plot", "probes", "view", "window"])
def test_pictures_are_shown(outputs: Outputs, name: str) -> None:
    (output,) = (o for o in outputs[name] if "data" in o)  # not what PyVista says of trame
    picture = Image.open(io.BytesIO(base64.b64decode(output["data"]["image/png"])))
    assert min(picture.size) > 200
    assert len(np.unique(np.asarray(picture.convert("L")))) > 20


def test_a_run_shows_its_progress_in_one_place(outputs: Outputs) -> None:
    (output,) = outputs["run"]  # updated in place
    assert "a pulled square: 100 %, finished after" in output["data"]["text/html"]
    assert 'value="1.000"' in output["data"]["text/html"]
    assert outputs["silent"] == []
    (sweep,) = outputs["sweep"]
    assert "3 run, the last with spacing 0.125" in sweep["data"]["text/html"]


def test_a_run_that_ends_early_says_so(outputs: Outputs) -> None:
    bar, error = outputs["failure"]
    assert "a pulled square: 33 %" in bar["data"]["text/plain"]  # three steps of nine
    assert "ZeroDivisionError after" in bar["data"]["text/plain"]
    assert "for the test" in error["evalue"]
