"""Pictures of a record, for a first look."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.results.probe_picture import draw_probes
from solidsph.results.record import Record

_STRESS = "cauchy_stress"


def draw(record: Record, folder: Path, stem: str, field: str = _STRESS) -> Sequence[Path]:
    """Draw a record, coloured by a field, into files in `folder` that begin with `stem`.

    Returns their paths; RecordError if the record has no such field.
    """
    record.field(field)
    folder.mkdir(parents=True, exist_ok=True)
    what = "motion" if field == _STRESS else re.sub(r"[^\w.-]+", "-", field)
    motion = folder / f"{stem}-{what}.png"
    energy = folder / f"{stem}-energy.png"
    if record.dimension == 1:
        _draw_histories(record, field, motion)
    else:
        _draw_bodies(record, field, motion)
    _draw_energies(record.times, record.history, energy)
    probes = draw_probes(record, folder / f"{stem}-probes.png")
    return [motion, energy] if probes is None else [motion, energy, probes]


def _magnitudes(values: Array) -> Array:
    """Scalars, lengths of vectors, or largest principal values of tensors, (n,)."""
    if values.ndim == 3:
        return largest_principal(values)
    return values if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def _label(record: Record, field: str) -> str:
    """Label of the colours."""
    words = field.replace("_", " ").replace("cauchy", "Cauchy")
    return f"{words} [{record.units[field]}]"


def _draw_histories(record: Record, field: str, path: Path) -> None:
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    order = real[np.argsort(particles.positions[real, 0])]
    X = particles.positions[order, 0]
    figure = Figure(figsize=(10.0, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(record.times, record.positions[:][:, order, 0] - X, color="0.4", linewidth=0.6)
    left.set(xlabel="time [s]", ylabel="displacement [m]")
    left.set_title(f"{len(order)} particles", fontsize=10)
    # In one dimension vectors and tensors have one component, drawn with its sign.
    values = record.field(field)[:].reshape(record.count, -1)[:, order]
    mesh = right.pcolormesh(X, record.times, values, cmap="cividis", shading="nearest")
    right.set(xlabel="X [m]", ylabel="time [s]")
    figure.colorbar(mesh, ax=right, label=_label(record, field))
    figure.savefig(path, dpi=150)


def _draw_bodies(record: Record, field: str, path: Path) -> None:
    particles = record.particles
    real = ~particles.ghosts
    spans = [np.ptp(record.positions[k][real], axis=0) for k in (0, -1)]
    extent = float(np.max(spans)) or 1.0
    height = 1.5 + 4.0 * min(1.2, max(0.4, float(max(span[1] for span in spans)) / extent))
    figure = Figure(figsize=(11.0, height), layout="constrained")
    solid = {"projection": "3d"} if record.dimension == 3 else {}
    axes = figure.subplots(1, 2, subplot_kw=solid)
    values = [_magnitudes(record.field(field)[k][real]) for k in (0, -1)]
    low, high = min(v.min() for v in values), max(v.max() for v in values)
    # Size of a marker that about fills a spacing, on an axis some 300 points wide.
    size = max(1.0, (280.0 * float(particles.spacings[0]) / extent) ** 2)
    for axis, k, colours in zip(axes, (0, -1), values, strict=True):
        x = record.positions[k][real]
        dots = axis.scatter(*x.T, c=colours, s=size, cmap="cividis", vmin=low, vmax=high)
        axis.set_title(f"t = {record.times[k]:.4g} s", fontsize=10)
        axis.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    kind = ("", "length of ", "largest principal ")[len(record.field(field).shape) - 2]
    figure.colorbar(dots, ax=axes, shrink=0.8, label=kind + _label(record, field))
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
    axis.set(xlabel="time [s]", ylabel="energy [J]")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    figure.savefig(path, dpi=150)
