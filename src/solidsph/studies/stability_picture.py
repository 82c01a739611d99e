"""Where the uniform state of a bar is unstable, over stretch and cover, scheme beside scheme."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from solidsph.studies.certificate import GROWS
from solidsph.studies.stability_map import StabilityMap

# Steps beyond so many CFL steps are told apart no longer.
_LARGEST_FACTOR = 5.0

# And faster growth than this, which neighbours about to be lost have, neither.
_LARGEST_RATE = 10.0


def draw_growth(
    maps: Mapping[str, StabilityMap], path: Path, *, title: str, mark: tuple[float, str]
) -> None:
    """One panel a scheme, of growth alone; a cover is marked, with what it is."""
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    axes = figure.subplots(1, len(maps), sharex=True, sharey=True)
    mesh = _growth_row(axes, maps)
    cover, told = mark
    for axis in axes:
        axis.axhline(cover, color="black", linewidth=0.8, linestyle="--")
        axis.set_xlabel("stretch")
    axes[0].text(6.0, cover - 0.08, told, ha="right", va="top")
    _finish(figure, axes, mesh, title, path)


def draw_certificates(maps: Mapping[str, StabilityMap], path: Path, *, title: str) -> None:
    """One column a scheme: growth above, the largest stable step below."""
    figure = Figure(figsize=(11.0, 9.2), layout="constrained")
    rows = figure.subplots(2, len(maps), sharex=True, sharey=True, squeeze=False)
    mesh = _growth_row(rows[0], maps)
    norm = Normalize(0.0, _LARGEST_FACTOR)
    for axis, one in zip(rows[1], maps.values(), strict=True):
        shown = np.where(one.connected, one.factors, np.nan)
        steps = axis.pcolormesh(
            one.stretches, one.covers, shown, norm=norm, cmap="cividis", shading="nearest"
        )
        _hatched(axis, one)
        axis.contour(one.stretches, one.covers, shown, levels=[1.0], colors="white", linewidths=1.5)
        axis.axvline(1.0, color="black", linewidth=0.8)
        axis.set_xlabel("stretch")
        least = float(np.nanmin(shown))
        axis.set_title(f"largest stable step: at least {least:.2g} CFL steps", fontsize=10)
    rows[1][0].set_ylabel("cover [reference spacings]")
    figure.colorbar(
        steps,
        ax=rows[1],
        extend="max",
        label="largest stable step / CFL step (white line: 1)",
    )
    _finish(figure, rows[0], mesh, title, path)


def _growth_row(axes: np.ndarray, maps: Mapping[str, StabilityMap]) -> ScalarMappable:
    largest = max(float(np.nanmax(one.rates)) for one in maps.values())
    norm = LogNorm(GROWS, min(max(largest, 10.0 * GROWS), _LARGEST_RATE))
    for axis, (name, one) in zip(axes, maps.items(), strict=True):
        shown = np.where(one.grows, one.rates, np.nan)
        mesh: ScalarMappable = axis.pcolormesh(
            one.stretches, one.covers, shown, norm=norm, cmap="viridis_r", shading="nearest"
        )
        _hatched(axis, one)
        axis.axvline(1.0, color="black", linewidth=0.8)
        axis.set_title(f"{name}: {_told(one)}", fontsize=10)
    return mesh


def _hatched(axis: Axes, one: StabilityMap) -> None:
    if one.connected.all():
        return
    axis.pcolor(
        one.stretches,
        one.covers,
        np.where(one.connected, np.nan, 0.0),
        cmap=ListedColormap(["white"]),
        hatch="////",
        edgecolor="0.3",
        linewidth=0.0,
        shading="nearest",
    )


def _finish(figure: Figure, axes: np.ndarray, mesh: ScalarMappable, title: str, path: Path) -> None:
    axes[0].set_ylabel("cover [reference spacings]")
    axes[0].text(1.08, 0.5 * sum(axes[0].get_ylim()), "unstretched", rotation=90, va="center")
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
        mesh,
        ax=axes,
        extend="max" if mesh.norm.vmax == _LARGEST_RATE else "neither",
        label="growth rate of the fastest mode [1 / transit of a spacing]",
    )
    figure.suptitle(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _told(one: StabilityMap) -> str:
    if not one.grows.any():
        return "no growth anywhere"
    return f"grows at up to {np.nanmax(one.rates):.2g}"
