"""The stretched sheet and its stress, also along the ligament above the hole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph_cases._field_picture import show_field


def draw_sheet(
    record: Record, peak: Measurement, radius: float, width: float, title: str, path: Path
) -> None:
    """Left the deformed sheet, right the stress on the line from the hole to the upper edge."""
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    body, line = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    particles = record.particles
    stress = 1e-6 * largest_principal(record.field("cauchy_stress")[-1])
    mesh = show_field(body, record, -1, stress)
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    body.plot(radius * np.cos(turn), radius * np.sin(turn), ":", color="0.4", linewidth=1.0)
    edge = width * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    body.plot(*edge.T, ":", color="0.4", linewidth=1.0)
    body.set_xlabel("x [m]")
    body.set_ylabel("y [m]")
    body.set_aspect("equal")
    body.set_title("deformed; dotted: before", fontsize=10)
    label = "largest principal Cauchy stress [MPa]"
    figure.colorbar(mesh, ax=body, location="bottom", shrink=0.8, aspect=40, label=label)

    X, Y = particles.positions.T
    spacing = float(particles.spacings[0])
    above = np.flatnonzero((np.abs(X) < 0.1 * spacing) & (Y > 0.0))
    above = above[np.argsort(Y[above])]
    line.plot(Y[above] / width, stress[above], "ko-", markersize=4, label="particles on X = 0")
    if peak.reference is not None:
        line.plot(
            radius / width,
            peak.reference,
            "s",
            markersize=12,
            markerfacecolor="none",
            markeredgecolor="0.3",
            markeredgewidth=1.8,
            linestyle="none",
            label=f"reference peak: {peak.reference:.2f} MPa",
        )
    line.set_xlabel("Y / W")
    line.set_ylabel("largest principal Cauchy stress [MPa]")
    line.set_xlim(0.0, 1.02)
    line.set_ylim(bottom=0.0)
    line.axvspan(0.0, radius / width, color="0.9")
    line.text(
        *(0.5 * radius / width, 0.04, "hole"),
        transform=line.get_xaxis_transform(),
        ha="center",
        rotation=90,
    )
    line.legend(frameon=False, loc="upper right")
    figure.suptitle(f"{title}: {particles.count} particles", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
