"""Pictures of Turek and Hron's beam: at rest, and in motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import TriMesh
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from solidsph.maths.arrays import Indices
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph_cases._field_picture import show_field
from solidsph_cases._turek_hron import ARC, RADIUS, Clamp, tip


def draw_at_rest(record: Record, held: Clamp, title: str, path: Path) -> None:
    """The bent beam, coloured by stress, with the published place of its tip."""
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    axes = figure.subplots()
    _surroundings(axes, record, held)
    stress = 1e-3 * largest_principal(record.field("cauchy_stress")[-1])
    mesh = show_field(axes, record, -1, stress)
    u = 1e3 * tip(record)[-1]
    rest = 1e3 * np.array(held.rest)
    end = record.particles.positions[record.particles.tagged("tip")].mean(axis=0)
    for colour, width in (("white", 4.0), ("black", 1.6)):
        axes.plot(*(end + 1e-3 * rest), "+", color=colour, markersize=14, markeredgewidth=width)
    axes.annotate(
        f"tip: u = ({u[0]:.3f}, {u[1]:.2f}) mm\nreference (+): ({rest[0]:.3f}, {rest[1]:.2f}) mm",
        end + 1e-3 * rest,
        xytext=(0.04, 0.07),
        textcoords="axes fraction",
        fontsize=10,
        arrowprops={"arrowstyle": "-", "color": "0.5", "relpos": (1.0, 0.5), "shrinkB": 8.0},
    )
    _frame(axes, f"{title}: {record.particles.count} particles")
    _key(figure, axes, mesh)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def draw_in_motion(record: Record, held: Clamp, title: str, path: Path) -> None:
    """The beam at its lowest, and both components of the tip's displacement over time."""
    figure = Figure(figsize=(8.5, 8.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, height_ratios=(1.15, 1.0))
    u = 1e3 * tip(record)
    lowest = int(np.argmin(u[:, 1]))
    _surroundings(upper, record, held)
    stress = 1e-3 * largest_principal(record.field("cauchy_stress")[lowest])
    mesh = show_field(upper, record, lowest, stress)
    for step in np.linspace(0, lowest, 5)[1:-1].astype(int):
        outline = record.positions[step][_outline(record)]
        upper.plot(*outline.T, ".", color="0.55", markersize=1.5)
    _frame(
        upper, f"{title}: {record.particles.count} particles, at t = {record.times[lowest]:.3f} s"
    )
    _key(figure, upper, mesh)

    lower.plot(record.times, u[:, 0], "--", color="0.45", label="$u_x$ of the tip")
    lower.plot(record.times, u[:, 1], "-", color="black", label="$u_y$ of the tip")
    lower.plot(
        held.first_minimum_time,
        1e3 * held.first_minimum,
        "o",
        markerfacecolor="none",
        markeredgecolor="black",
        markersize=10,
        linestyle="none",
        label=f"reference: {1e3 * held.first_minimum:.2f} mm at {held.first_minimum_time:g} s",
    )
    lower.set_xlabel("time [s]")
    lower.set_ylabel("displacement [mm]")
    lower.set_xlim(0.0, record.times[-1])
    lower.grid(color="0.9")
    lower.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _surroundings(axes: Axes, record: Record, held: Clamp) -> None:
    """The disc or the wall that holds the beam, and where the beam was without its weight."""
    X = record.particles.positions[_outline(record)]
    axes.plot(*X.T, ".", color="0.75", markersize=1.5)
    if held is ARC:
        axes.add_patch(Circle((-RADIUS, 0.0), RADIUS, facecolor="0.8", edgecolor="0.4"))
    else:
        axes.plot([0.0, 0.0], [-0.03, 0.03], color="0.4", linewidth=3.0)


def _key(figure: Figure, axes: Axes, mesh: TriMesh) -> None:
    label = "largest principal Cauchy stress [kPa]"
    figure.colorbar(mesh, ax=axes, label=label, location="bottom", shrink=0.6, aspect=40)


def _outline(record: Record) -> Indices:
    return record.particles.tagged("surface")


def _frame(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=11, loc="left")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_aspect("equal")
