"""A picture of where a run went wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solidsph.errors import BuildError, DivergedError
from solidsph.maths.arrays import Array, Indices
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene

# Radius of the surroundings of the particle, in the reference configuration [spacings].
_AROUND = 5.0


def draw_failure(simulation: BuiltScene, state: State, error: DivergedError, path: Path) -> None:
    """Draw the body, and beside it the surroundings of the particle, coloured by J."""
    particles = simulation.particles
    J = _volume_ratios(simulation, state)
    place = particles.positions[error.particle]
    distances = np.linalg.norm(particles.positions - place, axis=1)
    real = ~particles.ghosts & np.isfinite(state.positions).all(axis=1)
    near = real & (distances <= _AROUND * particles.spacings[error.particle])
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    solid = {"projection": "3d"} if particles.dimension == 3 else {}
    axes = figure.subplots(1, 2, subplot_kw=solid)
    for axis, chosen, title in (
        (axes[0], np.flatnonzero(real), f"t = {state.time:.4g} s, step {state.step}"),
        (axes[1], np.flatnonzero(near), f"around particle {error.particle}"),
    ):
        dots = _draw(axis, state.positions, J, chosen, error.particle)
        axis.set_title(title, fontsize=10)
    figure.colorbar(dots, ax=axes, shrink=0.8, label="volume ratio J [-]")
    figure.suptitle(error.cause, fontsize=10, wrap=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def _draw(axis: Any, positions: Array, J: Array, chosen: Indices, particle: int) -> Any:
    x = positions[chosen]
    if not len(x):
        x, chosen = np.zeros((1, positions.shape[1])), np.array([particle])
    shown = np.where(np.isfinite(J[chosen]), J[chosen], 0.0)
    style = {"c": shown, "cmap": "cividis", "vmin": 0.0, "vmax": 2.0}
    size = float(np.clip(2.5e4 / len(x), 2.0, 60.0))
    axis.set_xlabel("x [m]")
    if x.shape[1] == 1:
        dots = axis.scatter(x[:, 0], shown, s=size, **style)
        axis.set_ylabel("volume ratio J [-]")
        mark = np.array([[positions[particle, 0], J[particle]]])
    else:
        dots = axis.scatter(*x.T, s=size, **style)
        axis.set_ylabel("y [m]")
        if np.ptp(x, axis=0).max() > 0.0:
            axis.set_aspect("equal")
        mark = positions[[particle]]
    if np.isfinite(mark).all():
        ring = {"facecolors": "none", "edgecolors": "black", "s": 3.0 * size + 30.0}
        axis.scatter(*mark.T, linewidths=1.5, **ring)
    return dots


def _volume_ratios(simulation: BuiltScene, state: State) -> Array:
    try:
        with np.errstate(all="ignore"):
            return simulation.dynamics.observe(state).volume_ratios
    except (BuildError, ValueError):  # positions may be such that nothing has neighbours
        return np.full(simulation.particles.count, np.nan)
