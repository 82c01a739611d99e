"""Each effect's share of the steps: as `solidsph explain` predicts it, and as it is measured.

    python benchmarks/effect_shares.py                      every effect installed, some minutes
    python benchmarks/effect_shares.py --repeats 5 viscosity

A block that swings, with one effect, by both engines. Fresh processes measure, each: steps with and
without the effect in turns, by the time of the processor, of which the quickest samples count (what
else runs only ever adds). The medians of the processes are shown. An effect that needs other
parameters than typical ones, or another scene, has them in OWN.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from statistics import median
from typing import Any

from table import Table

from solidsph import Simulation, SolidsphError
from solidsph.commands.prediction import this_machine
from solidsph.costs.effect_shares import shares
from solidsph.registry import registry
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.receipts import measured_shares
from solidsph.testing.examples import example_part

ENGINES = ("matrix", "compiled")


def block(engine: str, lengths: list[float], spacing: float = 0.01) -> SceneBuilder:
    """A clamped block, thrown to the side."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": lengths}, spacing=spacing)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", density=1000.0, youngs_modulus=2e6, poissons_ratio=0.3)
        .boundary("clamp", where="left")
        .initial(velocity={"y": "0.5*X"})
        .engine(engine)
        .duration(0.2)
    )


def touching(engine: str) -> SceneBuilder:
    """That block, thrown against another."""
    right = {"type": "box", "lengths": [0.3, 0.4], "origin": [0.3, 0.0]}
    return (
        block(engine, [0.3, 0.4])
        .body("other", shape=right, spacing=0.01)
        .initial(where="X > 0.3", velocity={"x": -0.5})
    )


def typical(name: str) -> Callable[[str], SceneBuilder]:
    """The block with the effect of that name and typical values."""
    return lambda engine: block(engine, [0.6, 0.4]).effect(
        example_part("effects", name), label="it"
    )


# Where something else is called for: an effect's name, and the scene with it under the label "it".
OWN: Mapping[str, Callable[[str], SceneBuilder]] = {
    # Not in a few particles at a face, which nobody would notice.
    "body-force": lambda engine: block(engine, [0.6, 0.4]).effect(
        "body-force", acceleration={"y": -9.81}, label="it"
    ),
    # Where no bond fails: at a failure the sums are formed anew, which takes as long as many steps.
    "bond-failure": lambda engine: block(engine, [0.6, 0.4]).effect(
        "bond-failure", critical_stretch=0.5, label="it"
    ),
    "contact": lambda engine: touching(engine).effect("contact", label="it"),
    "joint": lambda engine: touching(engine).effect("joint", label="it"),
    "rigid-wall": lambda engine: block(engine, [0.6, 0.4]).effect(
        "rigid-wall", point={"x": 0.0}, normal={"x": 1.0}, label="it"
    ),
    "mass-damping": lambda engine: block(engine, [0.6, 0.4]).effect(
        "mass-damping", rate=2.0, label="it"
    ),
}


def both(name: str, engine: str) -> dict[str, Any]:
    """Predicted and measured share, in this process."""
    builder = OWN.get(name, typical(name))(engine)
    try:
        simulation = builder.build()
    except SolidsphError as cause:
        return {"problem": str(cause).splitlines()[-1].strip()}
    return {
        "particles": simulation.particles.count,
        "predicted": shares(simulation, this_machine())["it"].time,
        "measured": measured_shares(simulation)["it"],
    }


def row(name: str, engine: str, repeats: int) -> tuple[str, ...]:
    """Of one effect and engine, by several processes."""
    found = [_in_a_process(name, engine) for _ in range(repeats)]
    if "problem" in found[0]:
        return name, engine, "", "", "", found[0]["problem"], ""
    expected, true = (median(one[key] for one in found) for key in ("predicted", "measured"))
    least, most = (f(one["measured"] for one in found) for f in (min, max))
    return (
        name,
        engine,
        f"{found[0]['particles']}",
        f"{100 * expected:.1f}",
        f"{100 * true:.1f}",
        f"{100 * least:.1f} to {100 * most:.1f}",
        f"{expected / true:.2f}" if true > 0.0 else "",
    )


def _in_a_process(name: str, engine: str) -> dict[str, Any]:
    command = [sys.executable, __file__, name, "--one", engine]
    one = {**os.environ, "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=one)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", nargs="*", help="words of the effects wanted; all by default")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--one", choices=ENGINES, help="of one effect, as JSON")
    options = parser.parse_args()
    if options.one:
        print(json.dumps(both(options.which[0], options.one)))
        return
    names = [
        name
        for name in registry.names("effects")
        if not options.which or any(word in name for word in options.which)
    ]
    rows = []
    for name in names:
        for engine in ENGINES:
            rows.append(row(name, engine, options.repeats))
            print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
    columns = (
        "effect",
        "engine",
        "particles",
        "predicted %",
        "measured %",
        "from and to",
        "predicted over measured",
    )
    table = Table("Share of the steps", columns, tuple(rows), f"{options.repeats} processes each.")
    print(table.text())


if __name__ == "__main__":
    main()
