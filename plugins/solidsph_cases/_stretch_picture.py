"""Fig. 15: Cauchy stress over stretch, simulated beside the family of static curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph_cases._stretch_history import History, StressCurve

_MARKERS = "osD^v<>"
_STYLES = ("-", "--", "-.", ":")


def draw_stretch(
    histories: Mapping[str, History],
    curves: Mapping[str, StressCurve],
    end: float,
    losses: Mapping[str, Sequence[float]],
    path: Path,
) -> None:
    """The curves with the mean and the middle of the bar on the left, what swings on the right.

    Args:
        losses: stretches at which ellipticity changes on each curve, to be marked.
    """
    figure = Figure(figsize=(13.0, 6.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
    stretches = np.linspace(1.0, end, 400)
    for k, (label, curve) in enumerate(curves.items()):
        shown = label.replace("lambda_2", "$\\lambda_2$")
        left.plot(
            stretches,
            1e-6 * curve(stretches),
            color="black",
            linewidth=1.2,
            linestyle=_STYLES[k % len(_STYLES)],
            label=f"static, {shown}",
        )
        for j, stretch in enumerate(losses[label]):
            left.plot(
                stretch,
                1e-6 * float(curve(np.array([stretch]))[0]),
                linestyle="none",
                marker="Xo"[j % 2],
                color="black",
                markersize=10,
                label=f"ellipticity {('lost', 'regained')[j % 2]} at {stretch:.3f}, {shown}",
                zorder=4,
            )
    bar = histories["bar"]
    left.plot(
        bar.stretches,
        1e-6 * bar.amid,
        color="0.45",
        linewidth=0.8,
        label="bar, its middle",
        zorder=1,
    )
    strips = [name for name in histories if name == "bar" or name.startswith("strip")]
    for k, name in enumerate(strips):
        one = histories[name]
        spaced = slice(None, None, max(1, len(one.times) // 40))
        left.plot(
            one.stretches[spaced],
            1e-6 * one.mean[spaced],
            linestyle="none",
            marker=_MARKERS[k % len(_MARKERS)],
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor="0.2",
            label=f"{name}, mean",
            zorder=3,
        )
    left.set_xlabel("stretch of the whole, $\\lambda_1$")
    left.set_ylabel("Cauchy stress $\\sigma_{11}$ [MPa]")
    left.legend(loc="lower right", fontsize=9, frameon=False)

    static = bar.curve(bar.stretches)
    with np.errstate(divide="ignore", invalid="ignore"):
        swings = 100.0 * (bar.stresses / static[:, None] - 1.0)
        mean = 100.0 * (bar.mean / static - 1.0)
    begun = bar.stretches > 1.1
    right.fill_between(
        bar.stretches[begun],
        swings[begun].min(axis=1),
        swings[begun].max(axis=1),
        color="0.85",
        label="all particles of the bar",
    )
    right.plot(
        bar.stretches[begun],
        swings[begun, bar.middle],
        color="0.45",
        linewidth=0.8,
        label="its middle",
    )
    right.plot(bar.stretches[begun], mean[begun], color="black", linewidth=1.6, label="mean")
    right.axhline(0.0, color="black", linewidth=0.6)
    right.set_ylim(-60.0, 60.0)
    right.set_xlabel("stretch of the whole, $\\lambda_1$")
    right.set_ylabel("departure from the static curve [%]")
    right.legend(loc="upper right", fontsize=9, frameon=False)
    figure.suptitle("Pulled from rest without any new discretisation (Ismail & Reddy, Fig. 15)")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
