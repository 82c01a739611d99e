"""Figs. 12 to 14: a bar in tension, and how its particles move after the perturbation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.results.record import Record


def draw_configuration(record: Record, stretch: float, perturbation: float, path: Path) -> None:
    """Fig. 12: where the particles stand at the start, and the displacement of each."""
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    order = real[np.argsort(particles.positions[real, 0])]
    X, x = 1e3 * particles.positions[order, 0], 1e3 * record.positions[0][order, 0]
    middle = len(order) // 2
    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    bar, below = figure.subplots(2, 1, height_ratios=[1.0, 2.2])
    for height, places, name in ((1.0, X, "unstretched"), (0.0, x, f"stretch {stretch:g}")):
        bar.plot(places, np.full(len(places), height), "o", color="0.55", markersize=3)
        bar.plot(places[middle], height, "o", color="black", markersize=6)
        for end in (places[0], places[-1]):
            bar.plot([end, end], [height - 0.3, height + 0.3], color="black", linewidth=3.0)
        bar.text(-0.02 * x[-1], height, name, ha="right", va="center", fontsize=10)
    bar.set_ylim(-0.6, 1.6)
    bar.set_xlim(-0.16 * x[-1], 1.03 * x[-1])
    bar.set_yticks([])
    bar.spines[["left", "right", "top"]].set_visible(False)
    bar.set_xlabel("position [mm]")
    bar.set_title("particles; both ends (bars) are held, the centre one is displaced", fontsize=10)
    below.plot(X, (stretch - 1.0) * X, color="0.55", linewidth=1.0, label="uniform stretch")
    below.plot(X, x - X, "o", color="black", markersize=3, label="at the start")
    below.annotate(
        f"centre particle, {100 * perturbation:+g} %",
        (X[middle], x[middle] - X[middle]),
        (0.28 * X[-1], 0.75 * (x[-1] - X[-1])),
        arrowprops={"arrowstyle": "->"},
        fontsize=10,
    )
    below.set_xlabel("reference position X [mm]")
    below.set_ylabel("displacement [mm]")
    below.legend(loc="lower right", fontsize=9, frameon=False)
    figure.suptitle(
        "A bar stretched uniformly and perturbed (Ismail & Reddy, Fig. 12)", fontsize=11
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


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
