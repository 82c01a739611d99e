"""Pictures of stability maps, scheme beside scheme."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from solidsph.maths.arrays import Array
from solidsph.studies.certificate import GROWS
from solidsph.studies.stability_map import StabilityMap

# End of the colour scale of steps [CFL steps].
_LARGEST_FACTOR = 5.0

# End of the colour scale of growth rates, exceeded where neighbours are about to be lost.
_LARGEST_RATE = 10.0


def draw_growth(
    maps: Mapping[str, StabilityMap], path: Path, *, title: str, mark: tuple[float, str]
) -> None:
    """Draw growth, one panel for each scheme, with a line and a text at the cover of `mark`."""
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    axes = figure.subplots(1, len(maps), sharex=True, sharey=True)
    mesh = _growth_row(axes, maps)
    cover, text = mark
    for axis in axes:
        axis.axhline(cover, color="black", linewidth=0.8, linestyle="--")
        axis.set_xlabel("stretch")
    axes[0].text(6.0, cover - 0.08, text, ha="right", va="top")
    _finish(figure, axes, mesh, title, path)


def draw_certificates(maps: Mapping[str, StabilityMap], path: Path, *, title: str) -> None:
    """Draw growth above and the largest stable step below, one column for each scheme."""
    figure = Figure(figsize=(11.0, 9.2), layout="constrained")
    rows = figure.subplots(2, len(maps), sharex=True, sharey=True, squeeze=False)
    mesh = _growth_row(rows[0], maps)
    norm = Normalize(0.0, _LARGEST_FACTOR)
    for axis, m in zip(rows[1], maps.values(), strict=True):
        shown = np.where(m.connected, m.factors, np.nan)
        steps = _mesh(axis, m, shown, norm, "cividis")
        axis.contour(m.stretches, m.covers, shown, levels=[1.0], colors="white", linewidths=1.5)
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
    largest = max(float(np.nanmax(m.rates)) for m in maps.values())
    norm = LogNorm(GROWS, min(max(largest, 10.0 * GROWS), _LARGEST_RATE))
    for axis, (name, m) in zip(axes, maps.items(), strict=True):
        mesh = _mesh(axis, m, np.where(m.grows, m.rates, np.nan), norm, "viridis_r")
        rate = f"grows at up to {np.nanmax(m.rates):.2g}" if m.grows.any() else "no growth anywhere"
        axis.set_title(f"{name}: {rate}", fontsize=10)
    return mesh


def _mesh(axis: Axes, m: StabilityMap, values: Array, norm: Normalize, cmap: str) -> ScalarMappable:
    """Colours of `values`, hatched where particles have no neighbours, with a line at stretch 1."""
    mesh: ScalarMappable = axis.pcolormesh(
        m.stretches, m.covers, values, norm=norm, cmap=cmap, shading="nearest"
    )
    if not m.connected.all():
        axis.pcolor(
            m.stretches,
            m.covers,
            np.where(m.connected, np.nan, 0.0),
            cmap=ListedColormap(["white"]),
            hatch="////",
            edgecolor="0.3",
            linewidth=0.0,
            shading="nearest",
        )
    axis.axvline(1.0, color="black", linewidth=0.8)
    return mesh


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
