"""Figs. 16 to 18: the sheet as it is given, its stress at rest, and the waves on the way there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph_cases._field_picture import show_field
from solidsph_cases._sheet import MATERIAL, at_hole, extensions

# When the waves are shown [W / c_p]: from the edge to the hole, past it, and in the first swing.
_TIMES = (0.5, 0.9, 1.4, 2.5, 5.0, 9.6)


@attrs.frozen
class Quarter:
    """The sheet's sizes and its load."""

    radius: float  # of the hole [m]
    width: float  # W [m]
    crossing: float  # W / c_p [s]
    traction: float  # [Pa]


def draw_problem(record: Record, sheet: Quarter, path: Path) -> None:
    """Fig. 16: a quarter of the sheet, its particles, what holds it and what pulls it."""
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    axes = figure.subplots()
    particles, W = record.particles, sheet.width
    x, y = particles.positions.T / W
    surface = particles.tags["surface"]
    axes.plot(x[~surface], y[~surface], "o", color="0.6", markersize=3.5, label="inside")
    axes.plot(x[surface], y[surface], "ko", markersize=4.5, label="on the boundary")
    turn = np.linspace(0.0, 0.5 * np.pi, 100)
    a = sheet.radius / W
    axes.plot(a * np.cos(turn), a * np.sin(turn), "k-", linewidth=1.0)
    axes.plot([a, 1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0, a], "k-", linewidth=1.0)
    for height in np.linspace(0.05, 0.95, 7):
        axes.annotate(
            "", (1.17, height), (1.03, height), arrowprops={"arrowstyle": "-|>", "color": "black"}
        )
    words: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 10}
    axes.text(1.24, 0.5, f"traction {1e-6 * sheet.traction:g} MPa", rotation=90, **words)
    axes.text(-0.06, 0.5 * (1.0 + a), "symmetry", rotation=90, **words)
    axes.text(0.5 * (1.0 + a), -0.06, "symmetry", **words)
    axes.text(0.5, 1.05, "free", **words)
    axes.text(0.5 * a, -0.06, f"a = {a:g} W", **words)
    axes.annotate("", (a, 0.0), (0.0, 0.0), arrowprops={"arrowstyle": "<->", "color": "0.3"})
    axes.set_xlim(-0.12, 1.3)
    axes.set_ylim(-0.12, 1.12)
    axes.set_aspect("equal")
    axes.set_xlabel("X / W")
    axes.set_ylabel("Y / W")
    axes.set_title(
        f"a quarter of the sheet: {particles.count} particles, "
        f"E = {1e-6 * MATERIAL.youngs_modulus:g} MPa, $\\nu$ = {MATERIAL.poissons_ratio:g}",
        fontsize=10,
    )
    _save(figure, path)


def draw_final(
    sudden: Record,
    ramped: Record,
    sheet: Quarter,
    *,
    extension: float,
    peak: float | None,
    path: Path,
) -> None:
    """Fig. 17: the stress at rest; beside it how the edge and the stress come there, or do not.

    Args:
        extension: what u_x of the edge must be at rest, over W [-].
        peak: what the largest stress must be at rest [Pa]; None if it is not known.
    """
    figure = Figure(figsize=(12.0, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.1))
    axes = figure.add_subplot(grid[:, 0])
    stress = 1e-6 * largest_principal(ramped.field("cauchy_stress")[-1])
    mesh = show_field(axes, ramped, -1, stress)
    _draw_outline(axes, sheet)
    top = at_hole(ramped, sheet.radius, 90.0)
    axes.annotate(
        f"{stress[top]:.1f} MPa",
        ramped.positions[-1][top],
        xytext=(38, 14),
        textcoords="offset points",
        fontsize=10,
        color="white",
        arrowprops={"arrowstyle": "->", "color": "white"},
    )
    label = "largest principal Cauchy stress at rest [MPa]"
    figure.colorbar(mesh, ax=axes, location="bottom", shrink=0.85, aspect=40, label=label)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")

    above = figure.add_subplot(grid[0, 1])
    below = figure.add_subplot(grid[1, 1], sharex=above)
    end = max(float(record.times[-1]) for record in (sudden, ramped)) / sheet.crossing
    greatest = 60.0
    for record, grey, thickness, name in (
        (sudden, "0.55", 1.0, "sudden, undamped"),
        (ramped, "black", 1.8, "ramped, damped"),
    ):
        times = record.times / sheet.crossing
        extension_now = extensions(record) / sheet.width
        above.plot(times, extension_now, color=grey, linewidth=thickness, label=name)
        stresses = [largest_principal(one).max() for one in record.field("cauchy_stress")]
        below.plot(times, 1e-6 * np.array(stresses), color=grey, linewidth=thickness)
        greatest = max(greatest, 1e-6 * max(stresses))
    _draw_level(above, extension, f"equilibrium: {extension:.4f}", "--")
    if peak is not None:
        _draw_level(below, 1e-6 * peak, f"equilibrium: {1e-6 * peak:.1f} MPa", "--")
    twice = 6e-6 * sheet.traction
    _draw_level(below, twice, f"small hole, swinging in one mode: {twice:g} MPa", ":")
    _draw_level(below, 60.0, "the paper: 60 MPa", "-.")
    above.set_ylim(0.0, 1.3 * float(extensions(sudden).max()) / sheet.width)
    below.set_ylim(0.0, 1.15 * greatest)
    above.set_xlim(0.0, end)
    above.legend(frameon=False, fontsize=9, loc="upper right", ncols=2)
    above.set_ylabel("mean u_x of the edge / W")
    below.set_ylabel("largest stress [MPa]")
    below.set_xlabel("time [W / c_p]")
    figure.suptitle(
        f"The sheet comes to rest: {ramped.particles.count} particles (dotted: before)", fontsize=11
    )
    _save(figure, path)


def _draw_level(axes: Axes, height: float, label: str, style: str) -> None:
    """A line across, named at its right end."""
    axes.axhline(height, color="black", linestyle=style, linewidth=0.9)
    axes.annotate(
        label,
        (0.99, height),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, 3),
        textcoords="offset points",
        ha="right",
        fontsize=9,
    )


def draw_waves(record: Record, sheet: Quarter, path: Path) -> None:
    """Fig. 18: the stress at some times after the sudden load."""
    times = record.times / sheet.crossing
    steps = [int(np.argmin(np.abs(times - time))) for time in _TIMES if time <= times[-1]]
    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    panels = np.ravel(figure.subplots(2, 3, sharex=True, sharey=True))
    stresses: list[Array] = [
        1e-6 * largest_principal(record.field("cauchy_stress")[k]) for k in steps
    ]
    rows = (slice(0, 3), slice(3, 6))
    for row in rows:
        lowest = min(0.0, *(float(one.min()) for one in stresses[row]))
        highest = max(float(one.max()) for one in stresses[row])
        for axes, step, stress in zip(panels[row], steps[row], stresses[row], strict=False):
            mesh = show_field(axes, record, step, stress)
            mesh.set_clim(lowest, highest)
            _draw_outline(axes, sheet)
            axes.set_title(f"t = {times[step]:.1f} W / c_p", fontsize=10)
        figure.colorbar(
            mesh, ax=list(panels[row]), shrink=0.9, label="largest principal\nCauchy stress [MPa]"
        )
    for axes in panels[3:]:
        axes.set_xlabel("x [m]")
    for axes in panels[::3]:
        axes.set_ylabel("y [m]")
    figure.suptitle(
        f"{record.particles.count} particles, {1e-6 * sheet.traction:g} MPa suddenly at the right; "
        "dotted: before",
        fontsize=11,
    )
    _save(figure, path)


def _draw_outline(axes: Axes, sheet: Quarter) -> None:
    """The quarter before it was loaded."""
    turn = np.linspace(0.0, 0.5 * np.pi, 100)
    a, W = sheet.radius, sheet.width
    x = np.concatenate([a * np.sin(turn), [W, W, 0.0, 0.0]])
    y = np.concatenate([a * np.cos(turn), [0.0, W, W, a]])
    axes.plot(x, y, ":", color="0.35", linewidth=1.0)
    axes.set_aspect("equal")


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
