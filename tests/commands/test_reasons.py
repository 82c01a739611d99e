"""solidsph explain says truly why a gradient is used."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.commands.test_cli import solidsph

SCENE = """
duration = 1e-3
[body.b]
shape = {{type = "box", lengths = [1.0, 0.5]}}
spacing = 0.1
{discretisation}
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
{formulation}
"""
CONSISTENT, CORRECTED = "exact for a constant gradient of strain", "end before its surface"


@pytest.mark.parametrize(
    ("discretisation", "formulation", "reasons"),
    [
        ("", "", {"consistent": CONSISTENT, "cubic": "part of the formulation"}),
        ('discretisation = "conforming-lattice"', "", {"consistent": CONSISTENT}),
        ('discretisation = "lattice"', "", {"corrected": CORRECTED}),
        (
            'discretisation = "lattice"',
            '[formulation]\ntype = "total-lagrangian"\ndivergence = "plain"',
            {"corrected": CORRECTED, "plain": "named by the scene"},
        ),
        (
            "",
            '[formulation]\ntype = "total-lagrangian"\ngradient = "consistent"',
            {"consistent": "named by the scene", "cubic": "part of the formulation"},
        ),
        ("", 'formulation = "updated-lagrangian"', {"corrected": "part of the formulation"}),
        ('scheme = "corrected"', "", {"corrected": "Bonet & Lok"}),
    ],
)
def test_the_reason_of_a_gradient(
    discretisation: str, formulation: str, reasons: dict[str, str], tmp_path: Path
) -> None:
    text = SCENE.format(discretisation=discretisation, formulation=formulation)
    for key in ("scheme", "formulation"):  # keys of the scene stand above its tables
        lines = [line for line in text.splitlines() if line.startswith(f"{key} = ")]
        text = "\n".join(lines + [line for line in text.splitlines() if line not in lines])
    (tmp_path / "scene.toml").write_text(text)
    done = solidsph("explain", "scene.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (scene,) = json.loads(done.stdout)["scenes"].values()
    why = {part["name"]: part["why"] for part in scene["parts"]}
    for name, reason in reasons.items():
        assert reason in why[name]
