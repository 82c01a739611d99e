"""Where the uniform state of a bar is unstable, over stretch and cover, in both forms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from solidsph_builtin.cases._stability_map import GROWS, StabilityMap


def draw_maps(
    maps: Mapping[str, StabilityMap], cover: float, poissons_ratio: float, path: Path
) -> None:
    """One panel a form; `cover` is marked as the one of Figs. 13 and 14."""
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    axes = figure.subplots(1, len(maps), sharex=True, sharey=True)
    largest = max(float(one.rates.max()) for one in maps.values())
    norm = LogNorm(GROWS, max(largest, 10.0 * GROWS))
    for axis, (form, one) in zip(axes, maps.items(), strict=True):
        shown = np.where(one.grows, one.rates, np.nan)
        mesh = axis.pcolormesh(
            one.stretches, one.covers, shown, norm=norm, cmap="viridis_r", shading="nearest"
        )
        if not one.connected.all():
            apart = np.where(one.connected, np.nan, 0.0)
            axis.pcolor(
                one.stretches,
                one.covers,
                apart,
                cmap=ListedColormap(["white"]),
                hatch="////",
                edgecolor="0.3",
                linewidth=0.0,
                shading="nearest",
            )
        axis.axvline(1.0, color="black", linewidth=0.8)
        axis.axhline(cover, color="black", linewidth=0.8, linestyle="--")
        axis.set_xlabel("stretch")
        axis.set_title(f"{form}: {_told(one)}", fontsize=10)
    axes[0].set_ylabel("cover [reference spacings]")
    axes[0].text(1.08, 0.5 * sum(axes[0].get_ylim()), "unstretched", rotation=90, va="center")
    axes[0].text(6.0, cover - 0.08, "cover of Figs. 13 and 14", ha="right", va="top")
    axes[0].legend(
        handles=[
            Patch(facecolor="white", edgecolor="black", label="no growth"),
            Patch(facecolor="white", edgecolor="black", hatch="////", label="no neighbours left"),
        ],
        loc="lower right",
        fontsize=9,
        framealpha=1.0,
    )
    figure.colorbar(
        mesh, ax=axes, label="growth rate of the fastest mode [1 / transit of a spacing]"
    )
    figure.suptitle(
        f"Small deviations from a uniform stretch of an endless bar, "
        f"Poisson's ratio {poissons_ratio:g}: where they grow",
        fontsize=11,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _told(one: StabilityMap) -> str:
    if not one.grows.any():
        return "no growth anywhere"
    return f"grows at up to {one.rates.max():.2g}"
