"""Figs. 16 to 18: the sheet as it is given, its stress at rest, and the waves on the way there."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.results.record import Record
from solidsph_cases._sheet import MATERIAL, at_hole, extensions, largest_stresses
from solidsph_cases.drawing.fields import (
    LARGEST_STRESS,
    field,
    principal_stress,
    quarter_particles,
    quarter_sheet,
)
from solidsph_cases.drawing.sheet import (
    BELOW,
    Bar,
    Mark,
    Panel,
    Sheet,
    arrow,
    level,
    line,
    mark,
    text,
)

# When the waves are shown [W / c_p]: from the edge to the hole, past it, and in the first swing.
_TIMES = (0.5, 0.9, 1.4, 2.5, 5.0, 9.6)


@final
@attrs.frozen
class Quarter:
    """The sheet's sizes and its load."""

    radius: float  # of the hole [m]
    width: float  # W [m]
    crossing: float  # W / c_p [s]
    traction: float  # [Pa]

    @property
    def before(self) -> Mark:
        """Its outline before it was loaded."""
        outline = quarter_sheet(self.radius, self.width)
        return mark("plot", *outline, ":", color="0.35", linewidth=1.0)


def problem(record: Record, sheet: Quarter) -> Sheet:
    """A quarter of the sheet, its particles, what holds it and what pulls it."""
    a = sheet.radius / sheet.width
    pulls = (arrow((1.17, y), (1.03, y), color="black") for y in np.linspace(0.05, 0.95, 7))
    body = Panel(
        *quarter_particles(record, sheet.width),
        line(*quarter_sheet(a, 1.0), linewidth=1.0),
        *pulls,
        text(1.24, 0.5, f"traction {1e-6 * sheet.traction:g} MPa", rotation=90, fontsize=10),
        text(-0.06, 0.5 * (1.0 + a), "symmetry", rotation=90, fontsize=10),
        text(0.5 * (1.0 + a), -0.06, "symmetry", fontsize=10),
        text(0.5, 1.05, "free", fontsize=10),
        text(0.5 * a, -0.06, f"a = {a:g} W", fontsize=10),
        arrow((a, 0.0), (0.0, 0.0), "<->", color="0.3"),
        title=f"a quarter of the sheet: {record.particles.count} particles, "
        f"E = {1e-6 * MATERIAL.youngs_modulus:g} MPa, $\\nu$ = {MATERIAL.poissons_ratio:g}",
        x="X / W",
        y="Y / W",
        xlim=(-0.12, 1.3),
        ylim=(-0.12, 1.12),
        aspect="equal",
    )
    return Sheet([[body]], (6.4, 5.6))


def final_stress(
    sudden: Record, ramped: Record, sheet: Quarter, extension: float, peak: float | None
) -> Sheet:
    """The stress at rest; beside it how the edge and the stress come there, or do not.

    Args:
        extension: u_x of the edge that is to be reached at rest, over W [-].
        peak: the largest stress that is to be reached at rest [Pa]; None if it is not known.
    """
    stress, top = principal_stress(ramped, -1), at_hole(ramped, sheet.radius, 90.0)
    white = {"color": "white", "arrowprops": {"arrowstyle": "->", "color": "white"}}
    offset = {"xytext": (38, 14), "textcoords": "offset points", "fontsize": 10}
    place = ramped.positions[-1][top]
    body = Panel(
        field(ramped, -1, stress),
        sheet.before,
        mark("annotate", f"{stress[top]:.1f} MPa", place, **offset, **white),
        x="x [m]",
        y="y [m]",
    )
    above, below, greatest = [], [], 60.0
    for record, name, style in (
        (sudden, "sudden, undamped", {"color": "0.55", "linewidth": 1.0}),
        (ramped, "ramped, damped", {"color": "black", "linewidth": 1.8}),
    ):
        times, stresses = record.times / sheet.crossing, 1e-6 * largest_stresses(record)
        above.append(line(times, extensions(record) / sheet.width, "-", label=name, **style))
        below.append(line(times, stresses, "-", **style))
        greatest = max(greatest, float(stresses.max()))
    above.append(level(extension, f"equilibrium: {extension:.4f}", linestyle="--"))
    twice = 6e-6 * sheet.traction
    below.append(level(twice, f"small hole, swinging in one mode: {twice:g} MPa", linestyle=":"))
    below.append(level(60.0, "the paper: 60 MPa", linestyle="-."))
    if peak is not None:
        label = f"equilibrium: {1e-6 * peak:.1f} MPa"
        below.append(level(1e-6 * peak, label, linestyle="--"))
    end = max(float(record.times[-1]) for record in (sudden, ramped)) / sheet.crossing
    extending = Panel(
        *above,
        y="mean u_x of the edge / W",
        same_x="time",
        xlim=(0.0, end),
        ylim=(0.0, 1.3 * float(extensions(sudden).max()) / sheet.width),
        legend={"loc": "upper right", "ncols": 2},
    )
    stressing = Panel(
        *below,
        x="time [W / c_p]",
        y="largest stress [MPa]",
        same_x="time",
        ylim=(0.0, 1.15 * greatest),
    )
    title = f"The sheet comes to rest: {ramped.particles.count} particles (dotted: before)"
    bars = [Bar(f"{LARGEST_STRESS} at rest [MPa]", [body], BELOW)]
    rows = [[body, extending], [body, stressing]]
    return Sheet(rows, (12.0, 6.4), title, widths=(1.0, 1.1), bars=bars)


def waves(record: Record, sheet: Quarter) -> Sheet:
    """The stress at some times after the sudden load."""
    times = record.times / sheet.crossing
    steps = [int(np.argmin(np.abs(times - time))) for time in _TIMES if time <= times[-1]]
    rows, bars = [], []
    for shown in (steps[:3], steps[3:]):
        stresses = [principal_stress(record, step) for step in shown]
        colours = {
            "vmin": min(0.0, *(float(stress.min()) for stress in stresses)),
            "vmax": max(float(stress.max()) for stress in stresses),
        }
        panels = [
            Panel(
                field(record, step, stress, **colours),
                sheet.before,
                title=f"t = {times[step]:.1f} W / c_p",
                x="x [m]",
                y="y [m]",
                same_x="x",
                same_y="y",
            )
            for step, stress in zip(shown, stresses, strict=True)
        ]
        rows.append(panels)
        bars.append(Bar("largest principal\nCauchy stress [MPa]", panels, {"shrink": 0.9}))
    title = (
        f"{record.particles.count} particles, {1e-6 * sheet.traction:g} MPa suddenly at the right; "
        "dotted: before"
    )
    return Sheet(rows, (12.0, 7.6), title, bars=bars)
