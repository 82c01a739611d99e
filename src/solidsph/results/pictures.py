"""Pictures of a record, for a first look."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.arrays import Array
from solidsph.results.record import Record


def draw(record: Record, folder: Path, stem: str) -> Sequence[Path]:
    """Write the pictures of a record into `folder`; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    motion = folder / f"{stem}-motion.png"
    energy = folder / f"{stem}-energy.png"
    if record.dimension == 1:
        _draw_histories(record, motion)
    else:
        _draw_bodies(record, motion)
    _draw_energies(record.times, record.history, energy)
    return [motion, energy]


def von_mises(stress: Array) -> Array:
    """Equivalent stress of Cauchy stresses (n, d, d) without the components across the plane."""
    d = stress.shape[1]
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(d)
    across = (3 - d) * (np.trace(stress, axis1=1, axis2=2) / 3.0) ** 2
    equivalent: Array = np.sqrt(1.5 * (np.sum(deviator**2, axis=(1, 2)) + across))
    return equivalent


def _draw_histories(record: Record, path: Path) -> None:
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    order = real[np.argsort(particles.positions[real, 0])]
    X = particles.positions[order, 0]
    figure = Figure(figsize=(10.0, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(record.times, record.positions[:][:, order, 0] - X, color="0.4", linewidth=0.6)
    left.set_xlabel("time [s]")
    left.set_ylabel("displacement [m]")
    left.set_title(f"{len(order)} particles", fontsize=10)
    stress = record.field("cauchy_stress")[:][:, order, 0, 0]
    mesh = right.pcolormesh(X, record.times, stress, cmap="cividis", shading="nearest")
    right.set_xlabel("X [m]")
    right.set_ylabel("time [s]")
    figure.colorbar(mesh, ax=right, label="Cauchy stress [Pa]")
    figure.savefig(path, dpi=150)


def _draw_bodies(record: Record, path: Path) -> None:
    particles = record.particles
    real = ~particles.ghosts
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    solid = {"projection": "3d"} if record.dimension == 3 else {}
    axes = figure.subplots(1, 2, subplot_kw=solid)
    stresses = [von_mises(record.field("cauchy_stress")[k][real]) for k in (0, -1)]
    top = max(float(stress.max()) for stress in stresses)
    # Marker size that about fills a spacing, in points, on an axis some 300 points wide.
    first = record.positions[0][real]
    extent = float(np.ptp(first, axis=0).max()) or 1.0
    size = max(1.0, (280.0 * float(particles.spacings[0]) / extent) ** 2)
    for axis, k, stress in zip(axes, (0, -1), stresses, strict=True):
        x = record.positions[k][real]
        dots = axis.scatter(*x.T, c=stress, s=size, cmap="cividis", vmin=0.0, vmax=top or 1.0)
        axis.set_title(f"t = {record.times[k]:.4g} s", fontsize=10)
        axis.set_xlabel("x [m]")
        axis.set_ylabel("y [m]")
        axis.set_aspect("equal")
    figure.colorbar(dots, ax=axes, label="equivalent (von Mises) Cauchy stress [Pa]")
    figure.savefig(path, dpi=150)


def _draw_energies(times: Array, history: Mapping[str, Array], path: Path) -> None:
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    axis = figure.subplots()
    styles = ("-", "--", "-.", ":")
    energies = {name: values for name, values in history.items() if name.endswith("[J]")}
    for index, (name, values) in enumerate(energies.items()):
        axis.plot(
            times,
            values,
            linestyle=styles[index % len(styles)],
            color=str(0.7 * index / max(1, len(energies))),
            label=name.removesuffix(" [J]"),
        )
    axis.set_xlabel("time [s]")
    axis.set_ylabel("energy [J]")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    figure.savefig(path, dpi=150)
