"""The spinning square: its shape, and what it keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph_cases._energy import total_energy
from solidsph_cases._field_picture import show_field
from solidsph_cases.elastic_spin import (
    ANGULAR_VELOCITY,
    angular_momentum,
    smallest_distance,
)


def draw_spin(record: Record, title: str, path: Path) -> None:
    """The square at its largest and at the end; momentum, energy and distances over the turns."""
    figure = Figure(figsize=(11.0, 6.2), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.5))
    turns = record.times * ANGULAR_VELOCITY / (2.0 * np.pi)

    body = figure.add_subplot(grid[:, 0])
    stress = 1e-6 * largest_principal(record.field("cauchy_stress")[-1])
    mesh = show_field(body, record, -1, stress)
    start = record.positions[0][record.particles.tagged("surface")]
    body.plot(*start.T, ".", color="0.5", markersize=2)
    body.set_title(f"after {turns[-1]:.4g} turns (dots: at the start)", fontsize=10)
    body.set_xlabel("x [m]")
    body.set_ylabel("y [m]")
    body.set_aspect("equal")
    figure.colorbar(mesh, ax=body, location="bottom", label="largest principal Cauchy stress [MPa]")

    momentum, total = angular_momentum(record), total_energy(record)
    rows = (
        ("angular momentum\n(L - L$_0$) / L$_0$", momentum / momentum[0] - 1.0),
        ("energy\n(E - E$_0$) / E$_0$", total / total[0] - 1.0),
        ("smallest distance\n[spacings]", smallest_distance(record)),
    )
    for row, (label, values) in enumerate(rows):
        axes = figure.add_subplot(grid[row, 1])
        axes.plot(turns, values, "k-", linewidth=0.9)
        axes.set_ylabel(label, fontsize=9)
        axes.set_xlim(0.0, float(turns[-1]))
        formatter = ScalarFormatter(useMathText=True)
        formatter.set_powerlimits((-2, 2))
        axes.yaxis.set_major_formatter(formatter)
        axes.grid(color="0.9")
    axes.set_xlabel("time [turns]")
    axes.set_ylim(bottom=0.0)
    figure.suptitle(f"{title}: {record.particles.count} particles", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
