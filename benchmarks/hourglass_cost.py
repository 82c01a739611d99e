"""Time and memory of hourglass control beside the engine's forces, timed alternately.

    python benchmarks/hourglass_cost.py

3D blocks as in bench.py, on the threads that Numba takes. Read the ratios.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from bodies import ARRANGEMENTS, CELLS
from bodies import body as block

from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.engines.compiled.hourglass_sweeps import HourglassSweeps
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassProducts
from solidsph_builtin.effects.hourglass_control import penalised

REPEATS = 15
MOST_FOR_PRODUCTS = 20_000


def medians(actions: Sequence[Callable[[], object]]) -> list[float]:
    """Median milliseconds of each action, taken in turn; the first round compiles."""
    times = np.empty((REPEATS + 1, len(actions)))
    for repeat in range(REPEATS + 1):
        for number, action in enumerate(actions):
            begun = time.perf_counter()
            action()
            times[repeat, number] = 1e3 * (time.perf_counter() - begun)
    return [float(value) for value in np.median(times[1:], axis=0)]


def main() -> None:
    print("| block | particles | what | ms a step | bytes a particle | s to make |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in ARRANGEMENTS:
        for size in (10_000, 100_000):
            body = block(CELLS[3][size], name)
            n = body.particles.count
            u = 1e-4 * np.random.default_rng(0).standard_normal(body.particles.positions.shape)
            begun = time.perf_counter()
            engine = CompiledEngine().prepare([body], [])
            assert isinstance(engine, CompiledForces)
            rows = [("engine", engine.bytes, time.perf_counter() - begun)]
            actions: list[Callable[[], object]] = [lambda engine=engine, u=u: engine.forces(0.0, u)]
            kinds: list[type[HourglassSweeps] | type[HourglassProducts]] = [HourglassSweeps]
            if n < MOST_FOR_PRODUCTS:
                kinds.append(HourglassProducts)
            for kind in kinds:
                begun = time.perf_counter()
                penalty: HourglassOperator = kind.of(penalised(body, 0.3))
                rows.append((kind.__name__, penalty.bytes, time.perf_counter() - begun))
                actions.append(lambda penalty=penalty, u=u: penalty.forces(u))
            for (what, size, made), ms in zip(rows, medians(actions), strict=True):
                print(f"| {name} | {n} | {what} | {ms:.2f} | {size / n:.0f} | {made:.1f} |")


if __name__ == "__main__":
    main()
