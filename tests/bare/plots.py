"""Errors of bare scenes over spacing, one panel a scene."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log10
from pathlib import Path

from matplotlib.figure import Figure

from tests.bare.study import Study

_COLUMNS = 4
_LEAST = 1e-7  # errors below are drawn there: they are rounding


def draw(studies: Sequence[Study], folder: Path) -> Path:
    """Write `bare-scenes.png` to a folder, which is created."""
    rows = ceil(len(studies) / _COLUMNS)
    figure = Figure((4.2 * _COLUMNS, 3.3 * rows), layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for panel, study in zip(panels, studies, strict=False):
        for k, (name, bars) in enumerate(study.scene.bars.items()):
            found = study.history(name)
            spacings = [1.0 / (across - 1) for across in found]
            errors = [max(abs(error), _LEAST) for error in found.values()]
            style = {"color": f"C{k}"}
            panel.loglog(spacings, errors, "o-", label=name, **style)
            places = [1.0 / (across - 1) for across in bars]
            panel.loglog(
                places, list(bars.values()), "_", markersize=16, markeredgewidth=2, **style
            )
        across = study.scene.across
        panel.set_xticks([1.0 / (n - 1) for n in across], [str(n) for n in across])
        panel.minorticks_off()
        lowest, highest = panel.get_ylim()
        panel.set_ylim(10.0 ** floor(log10(lowest)), 10.0 ** ceil(log10(highest)))
        panel.set_xlabel("particles across")
        panel.set_title(study.scene.name, fontsize=10)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    for panel in panels[len(studies) :]:
        panel.set_axis_off()
    figure.suptitle("relative errors of bare scenes over spacing; dashes are bars")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "bare-scenes.png"
    figure.savefig(path, dpi=90)
    return path
