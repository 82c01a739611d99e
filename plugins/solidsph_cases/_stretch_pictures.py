"""Fig. 15: Cauchy stress over stretch, simulated beside the family of static curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from solidsph_cases._stretch_history import History, StressCurve
from solidsph_cases.drawing.sheet import Mark, Panel, Sheet, line, mark

_MARKERS = "osD^v<>"
_STYLES = ("-", "--", "-.", ":")


def stress_over_stretch(
    histories: Mapping[str, History],
    curves: Mapping[str, StressCurve],
    losses: Mapping[str, Sequence[float]],
    end: float,
) -> Sheet:
    """The curves with the mean and the middle of the bar, and the swings beside them.

    Args:
        histories: of the bar, named "bar", and of strips.
        losses: stretches at which ellipticity changes on each curve, to be marked.
        end: the largest stretch.
    """
    bar = histories["bar"]
    middle = {"color": "0.45", "linewidth": 0.8, "zorder": 1, "label": "bar, its middle"}
    marks = [line(bar.stretches, 1e-6 * bar.amid, "-", **middle)]
    stretches = np.linspace(1.0, end, 400)
    for k, (label, curve) in enumerate(curves.items()):
        shown = label.replace("lambda_2", "$\\lambda_2$")
        style = f"k{_STYLES[k % len(_STYLES)]}"
        stress = 1e-6 * curve(stretches)
        marks.append(line(stretches, stress, style, linewidth=1.2, label=f"static, {shown}"))
        for j, stretch in enumerate(losses[label]):
            change, style = (("lost", "kX"), ("regained", "ko"))[j % 2]
            words = f"ellipticity {change} at {stretch:.3f}, {shown}"
            stress = 1e-6 * curve(np.array([stretch]))
            marks.append(line([stretch], stress, style, markersize=10, label=words, zorder=4))
    marks += [
        _mean(name, history, _MARKERS[k % len(_MARKERS)])
        for k, (name, history) in enumerate(histories.items())
    ]
    left = Panel(
        *marks,
        x="stretch of the whole, $\\lambda_1$",
        y="Cauchy stress $\\sigma_{11}$ [MPa]",
        legend={"loc": "lower right"},
    )
    title = "Pulled from rest without any new discretisation (Ismail & Reddy, Fig. 15)"
    return Sheet([[left, _swings(bar)]], (13.0, 6.0), title, widths=(1.35, 1.0))


def _mean(name: str, history: History, marker: str) -> Mark:
    spaced = slice(None, None, max(1, len(history.times) // 40))
    look = {"markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": "0.2", "zorder": 3}
    stretches, stress = history.stretches[spaced], 1e-6 * history.mean[spaced]
    return line(stretches, stress, marker, label=f"{name}, mean", **look)


def _swings(bar: History) -> Panel:
    """Departures from the static curve, once the stretch is beyond the first waves."""
    begun = bar.stretches > 1.1
    stretches, static = bar.stretches[begun], bar.static[begun]
    swings = 100.0 * (bar.stresses[begun] / static[:, None] - 1.0)
    least, most = swings.min(axis=1), swings.max(axis=1)
    middle = {"color": "0.45", "linewidth": 0.8, "label": "its middle"}
    return Panel(
        mark(
            "fill_between", stretches, least, most, color="0.85", label="all particles of the bar"
        ),
        line(stretches, swings[:, bar.middle], "-", **middle),
        line(stretches, 100.0 * (bar.mean[begun] / static - 1.0), linewidth=1.6, label="mean"),
        mark("axhline", 0.0, color="black", linewidth=0.6),
        x="stretch of the whole, $\\lambda_1$",
        y="departure from the static curve [%]",
        ylim=(-60.0, 60.0),
        legend={"loc": "upper right"},
    )
