"""The picture of a twisting column: its surface at some times, and the twist of its top."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.results.record import Record

_SHOWN = 4


def draw_column(record: Record, angles: Array, title: str, path: Path) -> None:
    """Particles of the surface, shaded by speed, at four times; angles (t,) [rad] of the top."""
    figure = Figure(figsize=(13.0, 6.5), layout="constrained")
    grid = figure.add_gridspec(1, _SHOWN + 2)
    times = record.times
    X = record.particles.positions
    edge = np.any(
        [np.isclose(X[:, axis], end(X[:, axis])) for axis in (0, 1) for end in (np.min, np.max)],
        axis=0,
    )
    shown = np.linspace(0, len(times) - 1, _SHOWN + 1).astype(int)[1:]
    speeds = np.linalg.norm(record.field("velocity")[:], axis=2)
    largest = float(speeds[shown].max())
    for column, k in enumerate(shown):
        axes = figure.add_subplot(grid[column], projection="3d")
        x = record.positions[k][edge]
        points = axes.scatter(
            *x.T, c=speeds[k][edge], cmap="viridis", vmin=0.0, vmax=largest, s=10, depthshade=False
        )
        axes.set_box_aspect((1.0, 1.0, 4.0))
        axes.set_xlim(-1.0, 1.0)
        axes.set_ylim(-1.0, 1.0)
        axes.set_zlim(0.0, 8.0)
        axes.set_xticks([-1, 1])
        axes.set_yticks([-1, 1])
        axes.set_title(f"t = {times[k]:.3g} s", fontsize=10)
        axes.set_xlabel("x [m]", fontsize=8)
        axes.set_ylabel("y [m]", fontsize=8)
        axes.set_zlabel("z [m]", fontsize=8)
    figure.colorbar(points, ax=axes, shrink=0.5, label="speed [m/s]")
    history = figure.add_subplot(grid[_SHOWN:])
    history.plot(times, np.degrees(angles), color="black")
    history.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
    history.set_xlabel("time [s]")
    history.set_ylabel("twist of the top [degrees]")
    figure.suptitle(f"{title}: {record.particles.count} particles", fontsize=12)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
