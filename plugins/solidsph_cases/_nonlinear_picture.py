"""The nonlinear bar: profiles at one time, and wave speeds against the velocity of the end."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.results.record import Record
from solidsph_cases._bar import LENGTH, along, stress_along
from solidsph_cases._compare import FINISHED
from solidsph_cases._finite_waves import FiniteWave, Law


def draw_profiles(
    waves: Mapping[str, FiniteWave],
    records: Mapping[str, Record],
    law: Law,
    title: str,
    path: Path,
) -> None:
    """Stress along the bar at the end of each run: pushes above, pulls below."""
    names = sorted(waves, key=lambda name: (waves[name].velocity < 0.0, abs(waves[name].velocity)))
    columns = len(names) // 2
    figure = Figure(figsize=(4.3 * columns, 7.2), layout="constrained")
    grid = figure.subplots(2, columns, squeeze=False, sharex=True)
    for axes, name in zip(grid.flat, names, strict=True):
        wave, record, inviscid = waves[name], records[name], records[f"{name}-inviscid"]
        X, end = along(record), float(record.times[-1])
        places = np.linspace(0.0, LENGTH, 3000)
        modulus = law.lam + 2.0 * law.mu
        axes.plot(
            places,
            wave.stresses(places / end) / modulus,
            color="0.72",
            linewidth=4.0,
            label="exact",
        )
        axes.plot(
            X,
            stress_along(inviscid)[-1] / modulus,
            color="tab:blue",
            linewidth=0.7,
            label="SPH without viscosity",
        )
        axes.plot(
            X, stress_along(record)[-1] / modulus, "k.", markersize=3, label="SPH with viscosity"
        )
        plateau = wave.stress / modulus
        limits = (1.9 * plateau, -0.6 * plateau)
        axes.set_ylim(min(limits), max(limits))
        if inviscid.outcome != FINISHED:
            axes.text(
                0.5,
                0.97,
                f"without viscosity diverged at {1e6 * inviscid.times[-1]:.1f} us",
                transform=axes.transAxes,
                ha="center",
                va="top",
                fontsize=9,
            )
        speed = abs(wave.velocity) / law.small_speed
        kind = "push" if wave.velocity > 0.0 else "pull"
        axes.set_title(
            f"{kind} at {speed:g} c_p: stretch {wave.stretch:.4f}, t = {1e6 * end:.1f} us",
            fontsize=10,
        )
    for axes in grid[-1]:
        axes.set_xlabel("X [m]")
    for axes in grid[:, 0]:
        axes.set_ylabel("T11 / (lambda + 2 mu)")
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
    )
    figure.suptitle(f"{title}: {len(X)} particles", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def draw_speeds(
    law: Law,
    waves: Collection[FiniteWave],
    measured: Mapping[float, float],
    title: str,
    path: Path,
) -> None:
    """Speeds in the reference configuration over the velocity of the end, exact and measured."""
    figure = Figure(figsize=(7.0, 4.8), layout="constrained")
    axes = figure.add_subplot()
    c = law.small_speed
    largest = 1.1 * max(abs(wave.velocity) for wave in waves)
    velocities = np.linspace(0.002 * largest, largest, 40)
    shocks = [law.pushed(float(v)) for v in velocities]
    fans = [law.pulled(float(v)) for v in velocities]
    axes.plot(velocities / c, [w.head / c for w in shocks], "k-", label="shock")
    axes.fill_between(
        -velocities / c,
        [w.tail / c for w in fans],
        [w.head / c for w in fans],
        color="0.88",
        label="fan, from its tail to its head",
    )
    axes.plot(-velocities / c, [w.half_speed / c for w in fans], "k--", label="half of the fan")
    axes.axhline(1.0, color="0.5", linewidth=0.8, linestyle=":", label="linear theory")
    axes.plot(
        [v / c for v in measured],
        [speed / c for speed in measured.values()],
        "ko",
        markerfacecolor="white",
        markersize=7,
        label="SPH, level of half the plateau",
    )
    axes.set_xlabel("velocity of the end / c_p   (pull < 0 < push)")
    axes.set_ylabel("wave speed / c_p")
    axes.legend(frameon=False, loc="upper left")
    axes.set_title(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
