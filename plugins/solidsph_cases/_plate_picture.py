"""The plate's first bending mode: its shape, and the history of its tip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.formulas import Expression
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph_cases.cantilever_plate import LENGTH, mode_formula, tip_deflection


def draw_plate(record: Record, measured: Sequence[Measurement], title: str, path: Path) -> None:
    """Left the deflection of the mid-plane when it is largest, right the tip over time."""
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    particles, tip = record.particles, tip_deflection(record)
    largest = int(np.argmax(np.abs(tip)))
    spacing = float(particles.spacings[0])
    # The row at mid-height, or the one just above it.
    height = particles.positions[:, 1]
    middle = np.flatnonzero((height > -0.1 * spacing) & (height < 0.6 * spacing))
    X = particles.positions[middle, 0]
    u = (record.positions[largest] - particles.positions)[middle, 1]
    thinned = slice(None, None, max(1, len(middle) // 30))
    x = np.linspace(0.0, LENGTH, 200)
    shape = Expression.parse(mode_formula(), ("X",))({"X": x})
    left.plot(x, shape, "-", color="0.6", linewidth=3.0, label="beam theory")
    left.plot(X[thinned], u[thinned] / tip[largest], "ko", markersize=4, label="mid-plane")
    left.set_xlabel("X [m]")
    left.set_ylabel("deflection over that of the tip")
    left.legend(frameon=False, loc="upper left")

    history, natural = measured
    times = np.linspace(0.0, float(record.times[-1]), 400)
    amplitude = 1e3 * float(np.abs(tip).max())
    right.plot(
        times,
        amplitude * np.sin(2.0 * np.pi * times / (history.reference or np.nan)),
        "-",
        color="0.6",
        linewidth=3.0,
        label=f"reference: T = {history.reference:.4f} s",
    )
    right.plot(
        record.times,
        1e3 * tip,
        "ko",
        markersize=4,
        label=f"tip: T = {history.value:.4f} s (natural: {natural.value:.4f} s)",
    )
    right.axhline(0.0, color="0.8", linewidth=0.8)
    right.set_xlabel("time [s]")
    right.set_ylabel("deflection of the tip [mm]")
    right.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    figure.suptitle(f"{title}: {particles.count} particles", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
