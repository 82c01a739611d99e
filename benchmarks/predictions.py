"""Predicted against measured: time and memory of scenes of very different kind.

    python benchmarks/predictions.py                    all, some minutes
    python benchmarks/predictions.py --repeats 3 beam

Each scene is written to a file; `solidsph explain` predicts what it takes in one process, and
`solidsph run` takes it in others, fresh each time, of which the medians count. Time is from the
beginning of the build to the end of the run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from steps import bar, beam
from table import Table

from solidsph import Simulation
from solidsph.builder import Builder

SOFT = {"density": 1000.0, "youngs_modulus": 2e6, "poissons_ratio": 0.3}


def block(lengths: list[float], spacing: float, **body: Any) -> Builder:
    """A clamped block."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": lengths}, spacing=spacing, **body)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
    )


def swinging(lengths: list[float], spacing: float, **body: Any) -> Builder:
    """The same, thrown to the side."""
    return block(lengths, spacing, **body).initial(velocity={"y": "0.5*X"})


def jittered() -> dict[str, Any]:
    return {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}


SCENES: Mapping[str, Callable[[], Builder]] = {
    "1D bar, matrix": lambda: (
        bar().engine("matrix").integrator("central-difference").duration(2e-3).outputs(100)
    ),
    "2D statics": lambda: (
        block([1.0, 0.5], 0.0125)
        .effect("body-force", acceleration={"y": -5.0})
        .statics()
        .duration(1.0)
    ),
    "2D beam, compiled": lambda: beam().engine("compiled").duration(1.0).outputs(100),
    "3D lattice, 1e5": lambda: swinging([0.4, 0.4, 0.64], 0.01).duration(0.03).outputs(10),
    "3D jittered, 2e4": lambda: (
        swinging([0.2, 0.2, 0.5], 0.01, discretisation=jittered())
        .engine("compiled")
        .duration(0.1)
        .outputs(10)
    ),
    "3D float32": lambda: (
        swinging([0.3, 0.3, 0.5], 0.01).engine("compiled-float32").duration(0.1).outputs(10)
    ),
    "updated Lagrangian": lambda: (
        swinging([0.5, 0.25], 0.01).formulation("updated-lagrangian").duration(0.3).outputs(20)
    ),
    "hourglass control": lambda: (
        swinging([0.8, 0.4], 0.01)
        .effect("hourglass-control")
        .engine("compiled")
        .duration(0.5)
        .outputs(20)
    ),
    "viscosity and damping": lambda: (
        swinging([0.6, 0.6], 0.01)
        .effect("artificial-viscosity")
        .effect("mass-damping", rate=2.0)
        .engine("compiled")
        .duration(1.0)
        .outputs(20)
    ),
    "many outputs": lambda: swinging([1.0, 0.5], 0.02).engine("matrix").duration(0.4).outputs(2000),
    "consistent gradient": lambda: (
        swinging([0.3, 0.2], 0.01, discretisation=jittered())
        .formulation("total-lagrangian", gradient="consistent")
        .engine("matrix")
        .duration(0.3)
        .outputs(20)
    ),
}


def row(name: str, file: Path, repeats: int) -> tuple[str, ...]:
    """Of one scene."""
    explained = _solidsph("explain", file)
    ((_, facts),) = explained["scenes"].items()
    predicted = explained["predicted"]
    runs = [_solidsph("run", file, "--output", str(file.parent / "out")) for _ in range(repeats)]
    seconds = median(one["build time [s]"] + one["wall time [s]"] for one in runs)
    memory = median(one["peak memory [MiB]"] for one in runs)
    cost = {one["quantity"].strip(): one["value"] for one in facts["cost"]}
    parts = " + ".join(f"{cost[f'{part} [s]']:.2f}" for part in ("build", "compile", "steps"))
    return (
        name,
        f"{runs[0]['particles']}",
        f"{runs[0]['pair evaluations']:.2e}",
        f"{predicted['wall time [s]']:.2f}",
        f"{seconds:.2f}",
        f"{predicted['wall time [s]'] / seconds:.2f}",
        f"{predicted['peak memory [MiB]']:.0f}",
        f"{memory:.0f}",
        f"{predicted['peak memory [MiB]'] / memory:.2f}",
        f"{parts} + {cost['outputs [s]']:.2f}",
        f"{median(one['build time [s]'] for one in runs):.2f}",
    )


def _solidsph(verb: str, file: Path, *more: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "solidsph", verb, str(file), *more, "--json"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", nargs="*", help="words of the scenes wanted; all by default")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    wanted = [name for name in SCENES if not options.which or any(w in name for w in options.which)]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["SOLIDSPH_CACHE"] = folder  # so that this machine is calibrated anew
        for k, name in enumerate(wanted):
            file = Path(folder) / f"scene{k}.toml"
            file.write_text(SCENES[name]().scene().to_toml(), encoding="utf-8")
            rows.append(row(name, file, options.repeats))
            print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
    table = Table(
        "Predicted against measured",
        (
            "scene",
            "particles",
            "pair evaluations",
            "predicted s",
            "measured s",
            "ratio",
            "predicted MiB",
            "measured MiB",
            "ratio",
            "build + compile + steps + outputs, predicted s",
            "build s",
        ),
        tuple(rows),
        f"`solidsph explain` against the median of {options.repeats} runs of `solidsph run`.",
    )
    print(table.text())


if __name__ == "__main__":
    main()
