"""Figs. 12 to 14: a bar in tension, and how its particles move after the perturbation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solidsph.results.record import Record
from solidsph_cases._bar import along, displacements
from solidsph_cases.drawing.sheet import Mark, Panel, Sheet, line, mark, text


def configuration(record: Record, stretch: float, perturbation: float) -> Sheet:
    """Fig. 12: where the particles stand at the start, and the displacement of each."""
    X, u = 1e3 * along(record), 1e3 * displacements(record)[0]
    x, middle, end = X + u, len(X) // 2, X[-1] + u[-1]
    marks: list[Mark] = []
    for y, places, name in ((1.0, X, "unstretched"), (0.0, x, f"stretch {stretch:g}")):
        marks += [
            line(places, np.full(len(places), y), "o", color="0.55", markersize=3),
            line(places[middle], y, "ko", markersize=6),
            *(line([at, at], [y - 0.3, y + 0.3], linewidth=3.0) for at in places[[0, -1]]),
            text(-0.02 * end, y, name, ha="right", fontsize=10),
        ]
    bar = Panel(
        *marks,
        lambda axes: axes.spines[["left", "right", "top"]].set_visible(False),
        title="particles; both ends (bars) are held, the centre one is displaced",
        x="position [mm]",
        xlim=(-0.16 * end, 1.03 * end),
        ylim=(-0.6, 1.6),
        yticks=[],
    )
    below = Panel(
        line(X, (stretch - 1.0) * X, "-", color="0.55", linewidth=1.0, label="uniform stretch"),
        line(X, u, "ko", markersize=3, label="at the start"),
        mark(
            "annotate",
            f"centre particle, {100 * perturbation:+g} %",
            (X[middle], u[middle]),
            (0.28 * X[-1], 0.75 * u[-1]),
            arrowprops={"arrowstyle": "->"},
            fontsize=10,
        ),
        x="reference position X [mm]",
        y="displacement [mm]",
        legend={"loc": "lower right"},
    )
    title = "A bar stretched uniformly and perturbed (Ismail & Reddy, Fig. 12)"
    return Sheet([[bar], [below]], (9.0, 5.5), title, heights=(1.0, 2.2))


def motions(
    records: Mapping[str, Record], stretch: float, perturbation: float, transit: float
) -> Sheet:
    """One row a form: every particle on the left, the middle seven on the right."""
    rows = [_motions(form, record, transit) for form, record in records.items()]
    title = (
        f"Bar at stretch {stretch:g}, centre particle's displacement changed by "
        f"{100 * perturbation:g} % (Ismail & Reddy, Figs. 13 and 14)"
    )
    return Sheet(rows, (11.0, 7.5), title)


def _motions(form: str, record: Record, transit: float) -> list[Panel]:
    u, times = 1e3 * displacements(record), record.times / transit
    count = u.shape[1]
    middle = count // 2
    seven = [
        mark(
            *("plot", times, u[:, k]),
            color=str(0.18 * abs(k - middle)),
            linestyle=("-", "--", "-.", ":")[abs(k - middle)],
            linewidth=1.2 if k != middle else 1.8,
            label=None if k < middle else f"{k - middle} away" if k > middle else "centre",
        )
        for k in range(middle - 3, middle + 4)
    ]
    time = "time after the perturbation [wave transits of the bar]"
    every = Panel(
        line(times, u, "-", color="0.55", linewidth=0.6),
        line(times, u[:, middle], linewidth=1.4),
        title=f"{form}: all {count} particles, the centre one bold",
        x=time,
        y="displacement [mm]",
        same_x="left",
        same_y="every",
    )
    few = Panel(
        *seven,
        title=f"{form}: the middle seven",
        x=time,
        same_x="right",
        same_y="seven",
        legend={"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "fontsize": 8},
    )
    return [every, few]
