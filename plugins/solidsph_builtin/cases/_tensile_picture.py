"""Figs. 13 and 14: how the particles move after the perturbation, in both forms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.results.record import Record


def draw_forms(
    records: Mapping[str, Record],
    *,
    stretch: float,
    perturbation: float,
    transit: float,
    path: Path,
) -> None:
    """One row a form: every particle on the left, the middle seven on the right."""
    figure = Figure(figsize=(11.0, 7.5), layout="constrained")
    axes = figure.subplots(len(records), 2, sharex=True, sharey="col", squeeze=False)
    for row, (form, record) in zip(axes, records.items(), strict=True):
        particles = record.particles
        real = np.flatnonzero(~particles.ghosts)
        order = real[np.argsort(particles.positions[real, 0])]
        X = particles.positions[order, 0]
        u = 1e3 * (record.positions[:][:, order, 0] - X)
        times = record.times / transit
        middle = len(order) // 2
        seven = range(middle - 3, middle + 4)
        row[0].plot(times, u, color="0.55", linewidth=0.6)
        row[0].plot(times, u[:, middle], color="black", linewidth=1.4)
        row[0].set_ylabel("displacement [mm]")
        row[0].set_title(f"{form}: all {len(order)} particles, the centre one bold", fontsize=10)
        styles = ["-", "--", "-.", ":"]
        for k in seven:
            away = abs(k - middle)
            row[1].plot(
                times,
                u[:, k],
                color=str(0.18 * away),
                linestyle=styles[away],
                linewidth=1.8 if away == 0 else 1.2,
                label={0: "centre", 1: "1 away", 2: "2 away", 3: "3 away"}[away]
                if k >= middle
                else None,
            )
        row[1].set_title(f"{form}: the middle seven", fontsize=10)
        row[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    for axis in axes[-1]:
        axis.set_xlabel("time after the perturbation [wave transits of the bar]")
    figure.suptitle(
        f"Bar at stretch {stretch:g}, centre particle's displacement changed by "
        f"{100 * perturbation:g} % (Ismail & Reddy, Figs. 13 and 14)",
        fontsize=11,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
