"""Pictures of bodies that collide, slide and are pressed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.results.record import Record

if TYPE_CHECKING:
    from solidsph_cases.colliding_bars import CollidingBars
    from solidsph_cases.colliding_rings import CollidingRings
    from solidsph_cases.hertz import Hertz
    from solidsph_cases.sliding_block import SlidingBlock

_SHOWN = 6


def draw_bars(record: Record, case: CollidingBars, path: Path) -> None:
    """The force of contact and both mean velocities against time, in transits."""
    from solidsph_cases.colliding_bars import BEFORE, FORCE

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    force, velocity = figure.subplots(1, 2)
    t = record.times / case.transit - BEFORE
    force.plot(t, record.history[FORCE] / case.plateau, "k-", linewidth=1.0, label="simulated")
    exact = np.where((t > 0.0) & (t < 2.0), 1.0, 0.0)
    force.plot(t, exact, color="tab:orange", linestyle="--", label="waves of two bars")
    force.set_ylabel("force of contact [rho c v A / 2]")
    for values, name, exact, style in zip(
        case.mean_velocities(record).T / case.velocity,
        ("first", "second"),
        (1.0 - 0.5 * np.clip(t, 0.0, 2.0), 0.5 * np.clip(t, 0.0, 2.0)),
        ("-", ":"),
        strict=True,
    ):
        velocity.plot(t, values, "k", linestyle=style, label=f"{name} bar")
        velocity.plot(t, exact, color="tab:orange", linestyle="--", zorder=0)
    velocity.set_ylabel("mean velocity [v]")
    for axes in (force, velocity):
        axes.set_xlabel("time since the contact [L / c]")
        axes.legend(frameon=False)
    figure.suptitle(f"{case.title}: {record.particles.count} particles, {case.dimension}D")
    _save(figure, path)


def draw_rings(record: Record, case: CollidingRings, path: Path) -> None:
    """Particles shaded by J at some times, and what becomes of the energy."""
    figure = Figure(figsize=(13.0, 9.5), layout="constrained")
    half = _SHOWN // 2
    grid = figure.add_gridspec(3, 2 * half, height_ratios=(1.0, 1.0, 1.0))
    times = record.times
    J = record.field("volume_ratio")
    active = np.flatnonzero(record.history["contact touching pairs [-]"] > 0.0)
    end = int(active[-1]) if active.size else len(times) - 1
    shown = np.unique(np.linspace(0, min(len(times) - 1, int(1.6 * end)), _SHOWN).astype(int))
    places = np.concatenate([record.positions[int(k)] for k in shown])
    lower, upper = 1e3 * places.min(axis=0) - 2.0, 1e3 * places.max(axis=0) + 2.0
    span = max(abs(float(J[int(k)].min()) - 1.0) for k in shown)
    frames = []
    for place, k in enumerate(int(k) for k in shown):
        row, column = divmod(place, half)
        axes = figure.add_subplot(grid[row, 2 * column : 2 * column + 2])
        frames.append(axes)
        x, y = 1e3 * record.positions[k].T
        points = axes.scatter(
            x,
            y,
            c=J[k],
            cmap="coolwarm_r",
            vmin=1.0 - span,
            vmax=1.0 + span,
            s=4.0,
        )
        axes.set_aspect("equal")
        axes.set_xlim(lower[0], upper[0])
        axes.set_ylim(lower[1], upper[1])
        axes.set_title(f"t = {1e3 * times[k]:.2f} ms", fontsize=10)
        axes.set_xlabel("x [mm]", fontsize=8)
    figure.colorbar(points, ax=frames, shrink=0.7, label="J [-]")
    energies = figure.add_subplot(grid[2, :half])
    history = record.history
    start = history["kinetic energy [J]"][0]
    for name, label in (
        ("kinetic energy [J]", "kinetic"),
        ("strain energy [J]", "strain"),
        ("contact energy [J]", "contact"),
        ("energy residual [J]", "residual"),
    ):
        energies.plot(1e3 * times, history[name] / start, label=label)
    energies.set_ylabel("energy over that at the start [-]")
    speeds = figure.add_subplot(grid[2, half:])
    v = case.mean_velocities(record)[:, :, 0] / case.velocity
    for ring, name in enumerate(("western", "eastern")):
        speeds.plot(1e3 * times, v[:, ring], label=f"{name} ring")
    speeds.set_ylabel("mean velocity over that before [-]")
    for axes in (energies, speeds):
        axes.set_xlabel("t [ms]")
        axes.legend(frameon=False)
    figure.suptitle(f"{case.title}: {record.particles.count} particles, {case.speed:g} c0 each")
    _save(figure, path)


def draw_block(records: Mapping[str, Record], case: SlidingBlock, path: Path) -> None:
    """The way of both blocks, and the one that slides, at its start and end."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    ways, block = figure.subplots(1, 2)
    slides, sticks = records["slides"], records["sticks"]
    t = slides.times
    ways.plot(t, case.way(slides), "k-", label=f"{case.steep:g} degrees")
    expected = case.acceleration(case.steep) * case.moved(t)
    ways.plot(t, expected, color="tab:orange", linestyle="--", label="Coulomb's law")
    ways.plot(sticks.times, case.way(sticks), "k:", label=f"{case.flat:g} degrees")
    ways.set_xlabel("t [s]")
    ways.set_ylabel("way down the incline [m]")
    ways.legend(frameon=False)
    turn = np.radians(-case.steep)
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    for k, color in ((0, "0.7"), (-1, "black")):
        block.plot(*(R @ slides.positions[k].T), "o", color=color, markersize=3.0)
    ends = np.array([[-0.05, 0.0], [slides.positions[-1][:, 0].max() + 0.05, 0.0]])
    block.plot(*(R @ ends.T), "k-", linewidth=1.0)
    block.set_aspect("equal")
    block.set_xlabel("[m]")
    block.set_ylabel("[m]")
    figure.suptitle(f"{case.title}: {slides.particles.count} particles, f = {case.friction:g}")
    _save(figure, path)


def draw_foot(record: Record, case: Hertz, path: Path) -> None:
    """The pressures beside Hertz's, and the stress above them."""
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    pressures, field = figure.subplots(1, 2)
    x, p = case.pressures(record)
    width, peak = case.expected(record)
    pressures.plot(x, 1e-3 * p, "ko", markersize=4.0, label="simulated")
    along = np.linspace(0.0, width, 200)
    hertz = 1e-3 * peak * np.sqrt(1.0 - (along / width) ** 2)
    pressures.plot(along, hertz, color="tab:orange", label="Hertz")
    pressures.set_xlabel("x [m]")
    pressures.set_ylabel("pressure [kPa]")
    pressures.set_ylim(bottom=0.0)
    pressures.legend(frameon=False)
    positions: Array = record.positions[-1]
    stress = record.field("cauchy_stress")[-1][:, 1, 1] / peak
    near = np.all(positions < 3.0 * width, axis=1)
    x, y = positions[near].T
    points = field.scatter(x, y, c=stress[near], cmap="viridis", s=10)
    field.axhline(0.0, color="black", linewidth=1.0)
    field.set_aspect("equal")
    field.set_xlabel("x [m]")
    field.set_ylabel("y [m]")
    figure.colorbar(points, ax=field, label="vertical stress [peak pressure]")
    figure.suptitle(f"{case.title}: {record.particles.count} particles")
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
