"""The coefficients of the cost model, measured: prints src/solidsph/costs/coefficients.py.

    python benchmarks/fit_costs.py --rows rows.pickle > src/solidsph/costs/coefficients.py
    python benchmarks/fit_costs.py --only iteration compile > new.py        the others stay

Each body is built and run in a process of its own, on one thread, and every phase is timed by the
clock of the processor, which other programs disturb least. The terms of each phase come from the
model itself (`solidsph.costs.terms`); their coefficients are the ones, none below zero, that bring
the sum of squares of the relative errors down most. They are in units of the calibration of the
machine that measures, so that they hold on others.
"""

from __future__ import annotations

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import prod
from pathlib import Path
from statistics import median
from typing import Any

import attrs
import numpy as np
from scipy.optimize import nnls

from solidsph import Simulation
from solidsph.costs import terms
from solidsph.costs.calibration import Calibration, measure_calibration
from solidsph.costs.coefficients import COEFFICIENTS, REFERENCE
from solidsph.costs.count import count_work
from solidsph.costs.process import memory_now, peak_memory
from solidsph.costs.terms import CostTerm
from solidsph.costs.work import Work
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.system.cache import CACHE

SPACING, STEP = 0.01, 2e-5
VISCOSITY, HOURGLASS = {"type": "artificial-viscosity"}, {"type": "hourglass-control"}
GRAVITY = {"type": "body-force", "acceleration": {"x": 1.0}}
DRAG = {"type": "mass-damping", "rate": 1.0}
JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}
UPDATED = {"type": "updated-lagrangian"}


@attrs.frozen
class Specimen:
    """A body that is built and run."""

    cells: tuple[int, ...]
    engine: str
    cover: float = 2.6
    discretisation: Mapping[str, Any] = attrs.field(factory=lambda: {"type": "lattice"})
    formulation: Any = "total-lagrangian"
    material: str = "neo-hookean"
    effects: Sequence[Mapping[str, Any]] = ()
    clamps: Sequence[str] = ("left",)
    symmetry: bool = False
    steps: int = 40
    statics: bool = False
    bare: bool = False  # nothing of the scheme is named
    threads: int = 1
    outputs: int = 20

    def builder(self) -> SceneBuilder:
        """The scene."""
        lengths = [SPACING * n for n in self.cells]
        shape = (
            {"type": "interval", "length": lengths[0]}
            if len(lengths) == 1
            else {"type": "box", "lengths": lengths}
        )
        numbers = {"density": 1000.0, "youngs_modulus": 2e6, "poissons_ratio": 0.3}
        discretisation = dict(self.discretisation)
        if self.symmetry:
            discretisation |= {"ghosts": 3, "ghost_faces": ["right"]}
        if self.bare:
            return (
                Simulation.builder()
                .body("body", shape=shape, spacing=SPACING)
                .material(self.material, **numbers)
                .boundary("clamp", where="left")
                .effect(GRAVITY)
                .statics(solver="direct")
                .duration(1.0)
            )
        builder = (
            Simulation.builder()
            .body("body", shape=shape, spacing=SPACING, discretisation=discretisation)
            .kernel("cubic-spline", cover=self.cover)
            .material(self.material, **numbers)
            .formulation(self.formulation)
            .engine(self.engine)
        )
        for where in self.clamps:
            builder = builder.boundary("clamp", where=where)
        if self.symmetry:
            builder = builder.boundary("symmetry", axis="x", at=lengths[0])
        for effect in self.effects:
            builder = builder.effect(effect)
        if self.statics:
            return builder.statics(solver="direct").effect(GRAVITY).duration(1.0)
        return (
            builder.initial(velocity={"x": "0.01*X"})
            .integrator("central-difference", time_step=STEP)
            .duration(self.steps * STEP)
            .outputs(self.outputs)
        )


def specimens() -> Iterable[Specimen]:
    """All that is measured."""
    sizes = {1: [(60,), (1000,), (20000,)], 2: [(12, 10), (50, 40), (120, 80)]}
    sizes[3] = [(6, 6, 6), (12, 12, 12), (20, 16, 16)]
    for d, several in sizes.items():
        for cells in several:
            yield Specimen(cells, "matrix")
            yield Specimen(cells, "matrix", cover=3.5, discretisation=JITTERED)
            yield Specimen(cells, "matrix", material="saint-venant-kirchhoff", clamps=())
        some = several[1]
        yield Specimen(some, "matrix", clamps=("left", "right"))
        yield Specimen(some, "matrix", effects=(GRAVITY, DRAG))
        yield Specimen(several[0], "matrix", effects=(GRAVITY, DRAG))
        for cells in several[:2]:
            yield Specimen(cells, "matrix", effects=(VISCOSITY,))
            yield Specimen(cells, "matrix", effects=(HOURGLASS,))
            yield Specimen(cells, "matrix", formulation=UPDATED, steps=10)
            yield Specimen(cells, "compiled", formulation=UPDATED, steps=40)
        yield Specimen(some, "matrix", symmetry=True)
        wide = {1: (100_000,), 2: (300, 150), 3: (30, 30, 30)}[d]
        for cells in (some, wide):
            yield Specimen(cells, "compiled", steps=100)
            yield Specimen(cells, "compiled", steps=100, cover=3.5)
            yield Specimen(cells, "compiled-float32", steps=100)
            yield Specimen(cells, "compiled", steps=100, discretisation=JITTERED)
        yield Specimen(some, "compiled-float32", steps=100, discretisation=JITTERED)
        yield Specimen(some, "compiled", steps=100, effects=(VISCOSITY, DRAG))
        yield Specimen(some, "compiled", steps=100, effects=(GRAVITY,), clamps=())
        yield Specimen(some, "compiled", steps=100, effects=(HOURGLASS,))
        yield Specimen(some, "compiled", steps=100, symmetry=True)
        yield Specimen(some, "compiled", formulation=UPDATED, cover=3.5, steps=40)
        weighted = {"type": "updated-lagrangian", "gradient": "quadratic"}
        if d > 1:
            yield Specimen(some, "compiled", formulation=weighted, steps=10)
            yield Specimen(wide, "compiled", steps=20, threads=2)
            yield Specimen(wide, "compiled", steps=20, effects=(VISCOSITY,), threads=2)
    # What a particle takes where there are many of them.
    yield Specimen((400, 300), "compiled", steps=5)
    yield Specimen((60, 60, 60), "compiled", steps=5)
    yield Specimen((40, 40, 30), "compiled", steps=5, discretisation=JITTERED)
    for cells in ((20, 20), (60, 10), (60, 40), (100, 60), (4, 4, 12), (7, 7, 7), (9, 9, 9)):
        yield Specimen(cells, "matrix", statics=True)
    for cells in (
        (12, 12),
        (30, 30),
        (60, 60),
        (100, 4),
        (200, 16),
        (3, 3, 12),
        (6, 6, 12),
        (8, 8, 16),
    ):
        yield Specimen(cells, "auto", statics=True, bare=True)
    for cells in ((350, 20), (240, 12), (150, 30), (400, 6)):  # slender
        yield Specimen(cells, "matrix", statics=True)
    for cells in ((60, 20), (141, 9)):
        yield Specimen(cells, "matrix", statics=True, cover=3.5)
    for cells, count in (((12, 10), 1000), ((40, 25), 200), ((40, 25), 600), ((10, 10, 10), 1000)):
        yield Specimen(cells, "matrix", steps=count, outputs=count)


def measured(specimen: Specimen) -> tuple[Work, dict[str, float]]:
    """The work, and seconds, or bytes, of every phase, in this process."""
    bare = peak_memory()
    clock = time.process_time
    begun = clock()
    simulation = specimen.builder().build()
    found = {"build": clock() - begun, "build memory": float(peak_memory() - bare)}
    built, left = peak_memory(), memory_now()
    work = count_work(simulation)
    with tempfile.TemporaryDirectory() as folder:
        if specimen.statics:
            begun = clock()
            result = simulation.run(record=Path(folder) / "record.h5")
            found["iteration"] = (clock() - begun) / result.effort["iterations"]
        else:
            begun = clock()
            loop = simulation.time_loop()
            state = loop.advance(simulation.start(), 1)
            simulation.dynamics.observe(state)
            compiling = clock() - begun
            step = min(_taken(clock, loop, state, specimen.steps) for _ in range(3))
            observing = _observing(clock, simulation, state)
            found["compile"] = compiling - 2.0 * step - observing
            if specimen.threads == 1:
                found["step"] = step
            count = min(specimen.outputs, specimen.steps)
            many = _run_with_outputs(simulation, count, folder)
            one = _run_with_outputs(simulation, 1, folder)
            found["output"] = max(1e-5, (many - one) / (count - 1))
            file = one - (specimen.steps + 1) * step - 2 * found["output"]
            if file > 1e-2:  # or else it drowns in the steps
                found["file"] = file
    if peak_memory() > built:  # or else it is hidden in what the build has left
        found["run memory"] = float(peak_memory() - left)
    return work, found


def _taken(clock: Callable[[], float], loop: Any, state: Any, steps: int) -> float:
    begun = clock()
    loop.advance(state, state.step + steps)
    return (clock() - begun) / steps


def _observing(clock: Callable[[], float], simulation: Simulation, state: Any) -> float:
    begun = clock()
    simulation.dynamics.observe(state)
    return clock() - begun


def _run_with_outputs(simulation: Simulation, outputs: int, folder: str) -> float:
    """Processor time of a run with so many outputs; the least of two."""
    scene = attrs.evolve(simulation.scene, outputs=outputs)
    other = attrs.evolve(simulation, scene=scene)
    times = []
    for _ in range(2):
        begun = time.process_time()
        other.run(record=Path(folder) / f"{outputs}.h5")
        times.append(time.process_time() - begun)
    return min(times)


TERMS: Mapping[str, Callable[[Work], Iterable[CostTerm]]] = {
    "build": terms.build_terms,
    "compile": terms.compile_terms,
    "step": terms.step_terms,
    "output": terms.output_terms,
    "file": terms.start_terms,
    "iteration": terms.iteration_terms,
    "build memory": terms.build_memory,
    "run memory": terms.run_memory,
}


def fitted(
    rows: Sequence[tuple[Work, dict[str, float]]], units: Calibration, phases: Iterable[str]
) -> dict[str, float]:
    """Coefficients by name, phase by phase."""
    found: dict[str, float] = {}
    for phase in phases:
        of_work = TERMS[phase]
        own = [(list(of_work(work)), values[phase]) for work, values in rows if phase in values]
        own = [(row, value) for row, value in own if row]
        if not own:
            continue
        names = sorted({term.name for row, _ in own for term in row})
        place = {name: k for k, name in enumerate(names)}
        A, b = np.zeros((len(own), len(names))), np.ones(len(own))
        for k, (row, value) in enumerate(own):
            for term in row:
                A[k, place[term.name]] += term.count * term.unit.size(units) / value
        # Columns of very different size: scaled to their largest, and back.
        scale = np.maximum(A.max(axis=0), 1e-300)
        solution, _ = nnls(A / scale, b)
        found |= dict(zip(names, (solution / scale).tolist(), strict=True))
        errors = np.abs(A @ (solution / scale) - 1.0)
        print(
            f"{phase}: {len(own)} rows, {len(names)} terms, relative error: median "
            f"{np.median(errors):.2f}, 90 % below {np.quantile(errors, 0.9):.2f}, "
            f"largest {errors.max():.2f}",
            file=sys.stderr,
        )
    return found


def _median_calibration(count: int = 7) -> dict[str, Any]:
    """The median of several calibrations, unit by unit."""
    several = [attrs.asdict(measure_calibration()) for _ in range(count)]
    return {name: median(one[name] for one in several) for name in several[0]}


def _number(value: float) -> str:
    return f"{value}" if isinstance(value, int) else f"{value:.4g}"


HEAD = '''"""Coefficients of the cost model, in units of a calibration; those of memory in bytes.

Printed by `python benchmarks/fit_costs.py`, which says how they are measured; nothing here is
edited by hand.
"""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.costs.calibration import Calibration

'''


# The specimens that a phase needs: compiling takes as long for a small body.
_OF_FEW: Mapping[str, Callable[[Specimen], bool]] = {
    "iteration": lambda one: one.statics,
    "compile": lambda one: (
        one.engine.startswith("compiled") and (prod(one.cells) <= 5000 or one.threads > 1)
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--one", type=int, help="measure this specimen only, and pickle what is found"
    )
    parser.add_argument("--rows", type=Path, help="keep what was measured here, and go on from it")
    parser.add_argument(
        "--only",
        nargs="+",
        choices=_OF_FEW,
        default=[],
        help="fit these phases only, by the specimens that they need",
    )
    options = parser.parse_args()
    needed = [_OF_FEW[phase] for phase in options.only] or [lambda one: True]
    several = [one for one in specimens() if any(need(one) for need in needed)]
    if options.one is not None:
        sys.stdout.buffer.write(pickle.dumps(measured(several[options.one])))
        return
    kept: dict[str, Any] = {}
    if options.rows and options.rows.exists():
        kept = pickle.loads(options.rows.read_bytes())
    if "units" not in kept:
        kept["units"] = _median_calibration()
    for k, specimen in enumerate(several):
        key = repr(specimen)
        if key in kept:
            continue
        begun = time.perf_counter()
        command = [sys.executable, __file__, "--one", f"{k}"]
        command += ["--only", *options.only] if options.only else []
        with tempfile.TemporaryDirectory() as empty:  # so that nothing has been compiled before
            own = {"NUMBA_NUM_THREADS": f"{specimen.threads}", CACHE: empty}
            done = subprocess.run(
                command, capture_output=True, check=False, env={**os.environ, **own}
            )
        if done.returncode:
            raise SystemExit(f"{specimen}: {done.stderr.decode()}")
        kept[key] = pickle.loads(done.stdout)
        taken = time.perf_counter() - begun
        print(f"{k + 1} of {len(several)}: {taken:.1f} s, {specimen}", file=sys.stderr)
        if options.rows:
            options.rows.write_bytes(pickle.dumps(kept))
    units = Calibration(**kept["units"])
    rows = [kept[repr(one)] for one in several]
    coefficients = fitted(rows, units, options.only or TERMS)
    if options.only:
        coefficients = {**COEFFICIENTS, **coefficients}
        kept["units"] = attrs.asdict(REFERENCE)
    lines = "".join(f'    "{name}": {value:.4g},\n' for name, value in sorted(coefficients.items()))
    machine = "".join(f"    {name}={_number(value)},\n" for name, value in kept["units"].items())
    sys.stdout.write(
        f"{HEAD}# Of the machine that they were measured on.\n"
        f"REFERENCE = Calibration(\n{machine})\n\n"
        f"COEFFICIENTS: Mapping[str, float] = {{\n{lines}}}\n"
    )


if __name__ == "__main__":
    main()
