"""Predicted against measured: time and memory of scenes of very different kind.

    python benchmarks/predictions.py                    all, some minutes
    python benchmarks/predictions.py --repeats 3 beam
    python benchmarks/predictions.py --again            what was compiled before

Each scene is written to a file. One process predicts what it takes, as `solidsph explain` does;
others take it, as `solidsph run` does, fresh each time or --again, of which the medians count.
Time is from the beginning of the build to the end of the run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from steps import bar, beam
from table import Table

from solidsph import Scene, Simulation
from solidsph.commands.prediction import build_timed, this_machine
from solidsph.costs.prediction import predict_run
from solidsph.costs.process import peak_memory
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.system.cache import COMPILATIONS, COMPILED

SOFT = {"density": 1000.0, "youngs_modulus": 2e6, "poissons_ratio": 0.3}


def block(lengths: list[float], spacing: float, **body: Any) -> SceneBuilder:
    """A clamped block."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": lengths}, spacing=spacing, **body)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
    )


def swinging(lengths: list[float], spacing: float, **body: Any) -> SceneBuilder:
    """The same, thrown to the side."""
    return block(lengths, spacing, **body).initial(velocity={"y": "0.5*X"})


def bare_block(across: int) -> SceneBuilder:
    """A cantilever that names nothing of the scheme, pulled aside by its end."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [4.0, 1.0, 1.0]}, spacing=1.0 / across)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": -4e3})
    )


def jittered() -> dict[str, Any]:
    return {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}


SCENES: Mapping[str, Callable[[], SceneBuilder]] = {
    "1D bar, matrix": lambda: (
        bar().engine("matrix").integrator("central-difference").duration(2e-3).outputs(100)
    ),
    "2D statics": lambda: (
        block([0.35, 0.02], 0.001)
        .material("saint-venant-kirchhoff", youngs_modulus=1.4e6, poissons_ratio=0.4, density=1e3)
        .effect("body-force", acceleration={"y": -2.0})
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
    "Mooney-Rivlin": lambda: (
        swinging([0.2, 0.2, 0.2], 0.01)
        .material("mooney-rivlin", c10=3e5, c01=1e5, bulk_modulus=2e6, density=1000.0)
        .engine("compiled")
        .duration(0.2)
        .outputs(10)
    ),
    "3D statics, direct": lambda: bare_block(9).statics(solver="direct").duration(1.0),
    "3D statics": lambda: bare_block(12).statics().duration(1.0),
    "3D statics, nu 0.49": lambda: (
        bare_block(12)
        .material("neo-hookean", **{**SOFT, "poissons_ratio": 0.49})
        .statics()
        .duration(1.0)
    ),
    "statics far bent": lambda: (
        block([0.4, 0.04], 0.002)
        .effect("body-force", acceleration={"y": -40.0})
        .statics()
        .duration(1.0)
    ),
    "heat": lambda: (
        swinging([0.2, 0.2, 0.2], 0.01)
        .effect("heat", conductivity=1.0, heat_capacity=1e3)
        .engine("compiled")
        .duration(0.2)
        .outputs(10)
    ),
    "contact": lambda: (
        swinging([0.2, 0.2, 0.2], 0.01)
        .body(
            "other",
            shape={"type": "box", "lengths": [0.2] * 3, "origin": [0.0, 0.2, 0.0]},
            spacing=0.01,
        )
        .effect("contact", friction=0.3)
        .engine("compiled")
        .duration(0.1)
        .outputs(10)
    ),
    "many effects": lambda: (
        swinging([0.2, 0.2, 0.2], 0.01)
        .effect("hourglass-control")
        .effect("artificial-viscosity")
        .effect("heat", conductivity=1.0, heat_capacity=1e3)
        .effect("body-force", acceleration={"z": -9.81})
        .effect("mass-damping", rate=2.0)
        .engine("compiled")
        .duration(0.1)
        .outputs(10)
    ),
    "plasticity": lambda: (
        swinging([0.2, 0.2, 0.2], 0.01)
        .material("j2-plasticity", **SOFT, yield_stress=1e4, hardening=1e5)
        .engine("compiled")
        .duration(0.1)
        .outputs(10)
    ),
    "many outputs": lambda: swinging([1.0, 0.5], 0.02).engine("matrix").duration(0.4).outputs(2000),
    "consistent gradient": lambda: (
        swinging([0.3, 0.2], 0.01, discretisation={"type": "conforming-lattice"})
        .formulation("total-lagrangian", gradient="consistent")
        .engine("matrix")
        .duration(0.3)
        .outputs(20)
    ),
}


def predicted(file: Path) -> dict[str, Any]:
    """What `solidsph explain` expects, by the clock on the wall and by that of the processor."""
    begun = time.process_time()
    simulation, build = build_timed(Scene.read(file))
    spent = time.process_time() - begun
    found = predict_run(simulation, this_machine(), built=build)
    return {
        "seconds": found.seconds,
        "processor": found.run_seconds + spent,
        "memory": found.memory,
        "parts": dict(found.parts),
        "particles": found.work.particles,
        "pair evaluations": found.work.pair_evaluations,
    }


def measure(file: Path, record: Path) -> dict[str, Any]:
    """What `solidsph run` takes."""
    begun, spent = time.perf_counter(), time.process_time()
    simulation, _ = build_timed(Scene.read(file))
    simulation.run(record=record)
    return {
        "seconds": time.perf_counter() - begun,
        "processor": time.process_time() - spent,
        "memory": peak_memory(),
    }


def row(name: str, file: Path, repeats: int, *, again: bool) -> tuple[str, ...]:
    """Of one scene, whose functions were compiled before if it is run `again`."""
    if again:
        _in_a_process("--measure", file, keep=True)
    expected = _in_a_process("--predict", file, keep=again)
    runs = [_in_a_process("--measure", file, keep=again) for _ in range(repeats)]
    quantities = ("seconds", "processor", "memory")
    found = {one: median(run[one] for run in runs) for one in quantities}
    cells: list[str] = []
    for one in quantities:
        size = 2**20 if one == "memory" else 1.0
        cells += [f"{expected[one] / size:.2f}", f"{found[one] / size:.2f}"]
        cells += [f"{expected[one] / found[one]:.2f}"]
    parts = " + ".join(f"{seconds:.2f}" for seconds in expected["parts"].values())
    work = f"{expected['particles']}", f"{expected['pair evaluations']:.1e}"
    return (name, *work, *cells, parts)


def _in_a_process(what: str, file: Path, *, keep: bool) -> dict[str, Any]:
    if not keep:
        for store in (COMPILED, COMPILATIONS):  # every run is a first one, and so predicted
            store.clear()
    command = [sys.executable, __file__, what, str(file)]
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
    parser.add_argument("--again", action="store_true", help="runs for which all is compiled")
    parser.add_argument("--threads", type=int, help="as many as there are cores by default")
    parser.add_argument("--predict", type=Path, help="this scene only, as JSON")
    parser.add_argument("--measure", type=Path, help="this scene only, as JSON")
    options = parser.parse_args()
    if options.predict or options.measure:
        file = options.predict or options.measure
        found = predicted(file) if options.predict else measure(file, file.with_suffix(".h5"))
        print(json.dumps(found))
        return
    if options.threads:
        os.environ["NUMBA_NUM_THREADS"] = f"{options.threads}"
    wanted = [name for name in SCENES if not options.which or any(w in name for w in options.which)]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["SOLIDSPH_CACHE"] = folder  # so that this machine is calibrated anew
        begun = time.perf_counter()
        this_machine()
        calibrating = time.perf_counter() - begun
        for k, name in enumerate(wanted):
            file = Path(folder) / f"scene{k}.toml"
            file.write_text(SCENES[name]().scene().to_toml(), encoding="utf-8")
            rows.append(row(name, file, options.repeats, again=options.again))
            print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
    each = ("predicted", "measured", "ratio")
    table = Table(
        "Predicted against measured",
        (
            "scene",
            "particles",
            "pair evaluations",
            *(f"{one} {what}" for what in ("s", "processor s", "MiB") for one in each),
            "predicted build + compile + steps + outputs",
        ),
        tuple(rows),
        f"Medians of {options.repeats} runs; the calibration took {calibrating:.2g} s. Where other "
        "programs want the cores, time on the wall is what they leave; the processor's own, with "
        "--threads 1, is that of a quiet machine.",
    )
    print(table.text())


if __name__ == "__main__":
    main()
