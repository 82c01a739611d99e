"""Pictures of a record, for a first look."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.results.picture import Picture, discs
from solidsph.results.probe_picture import draw_probes, probe_columns
from solidsph.results.recorded import Recorded

STRESS = "cauchy_stress"

MOTION, ENERGY, PROBES = "motion", "energy", "probes"


def draw(record: Recorded, folder: Path, stem: str, field: str = STRESS) -> Sequence[Path]:
    """Draw a record, coloured by a field, into files in `folder` that begin with `stem`.

    Returns their paths; RecordError if the record has no such field.
    """
    motion = "motion" if field == STRESS else re.sub(r"[^\w.-]+", "-", field)
    names = {MOTION: motion, ENERGY: ENERGY, PROBES: PROBES}
    drawn = {what: figure(record, what, field) for what in (MOTION, ENERGY)}
    if probe_columns(record):
        drawn[PROBES] = figure(record, PROBES)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for what, made in drawn.items():
        paths.append(folder / f"{stem}-{names[what]}.png")
        made.savefig(paths[-1], dpi=150)
    return paths


def figure(record: Recorded, what: str = "motion", field: str = STRESS) -> Figure:
    """One picture of a record.

    Args:
        record: to be drawn.
        what: "motion", the body at the first and the last output, coloured by a field; "energy",
            the energies over time; "probes", what the probes measured, with error bars.
        field: that colours the motion.

    Raises:
        RecordError: there is no such picture or field, or no probe.
    """
    if what == MOTION:
        record.field(field)
        one = record.dimension == 1
        return _draw_histories(record, field) if one else _draw_bodies(record, field)
    if what == ENERGY:
        return _draw_energies(record.times, record.history)
    if what == PROBES:
        return draw_probes(record)
    known = ", ".join((MOTION, ENERGY, PROBES))
    raise RecordError(f"there is no picture of {what!r}; take one of {known}")


def magnitudes(values: Array) -> Array:
    """Scalars, lengths of vectors, or largest principal values of tensors, (n,)."""
    if values.ndim == 3:
        return largest_principal(values)
    return values if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def colour_label(record: Recorded, field: str) -> str:
    """Label of colours that show the magnitudes of a field."""
    kind = ("", "length of ", "largest principal ")[len(record.field(field).shape) - 2]
    return kind + _label(record, field)


def _label(record: Recorded, field: str) -> str:
    words = field.replace("_", " ").replace("cauchy", "Cauchy")
    return f"{words} [{record.field(field).unit}]"


def _draw_histories(record: Recorded, field: str) -> Figure:
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    order = real[np.argsort(particles.positions[real, 0])]
    X = particles.positions[order, 0]
    drawn = Picture(figsize=(10.0, 4.5), layout="constrained")
    left, right = drawn.subplots(1, 2)
    left.plot(record.times, record.positions[:][:, order, 0] - X, color="0.4", linewidth=0.6)
    left.set(xlabel="time [s]", ylabel="displacement [m]")
    left.set_title(f"{len(order)} particles", fontsize=10)
    # In one dimension vectors and tensors have one component, drawn with its sign.
    values = record.field(field)[:].reshape(record.count, -1)[:, order]
    mesh = right.pcolormesh(X, record.times, values, cmap="cividis", shading="nearest")
    right.set(xlabel="X [m]", ylabel="time [s]")
    drawn.colorbar(mesh, ax=right, label=_label(record, field))
    return drawn


def _draw_bodies(record: Recorded, field: str) -> Figure:
    particles = record.particles
    real = ~particles.ghosts
    spans = [np.ptp(record.positions[k][real], axis=0) for k in (0, -1)]
    extent = float(np.max(spans)) or 1.0
    solid = record.dimension == 3
    tallest = 1.0 if solid else float(max(span[1] for span in spans)) / extent
    height = 1.5 + 4.0 * min(1.2, max(0.4, tallest))
    drawn = Picture(figsize=(11.0, height), layout="constrained")
    axes = drawn.subplots(1, 2, subplot_kw={"projection": "3d"} if solid else {})
    values = [magnitudes(record.field(field)[k][real]) for k in (0, -1)]
    low, high = min(v.min() for v in values), max(v.max() for v in values)
    spacings = particles.spacings[real]
    colouring = {"cmap": "cividis", "clim": (low, high)}
    for axis, k, colours in zip(axes, (0, -1), values, strict=True):
        x = record.positions[k][real]
        axis.set_title(f"t = {record.times[k]:.4g} s", fontsize=10)
        axis.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        if not solid:
            dots = axis.add_collection(discs(x, spacings, axis, array=colours, **colouring))
            axis.margins(0.02 + float(spacings.max()) / extent)
        else:
            # A marker about fills a spacing, on an axis some 300 points wide; colours as in the
            # bar.
            sizes = np.maximum(1.0, (280.0 * spacings / extent) ** 2)
            dots = axis.scatter(*x.T, c=colours, s=sizes, depthshade=False, **colouring)
            # Few ticks and room for labels, which a slender body leaves little of.
            axis.set(zlabel="z [m]")
            axis.locator_params(nbins=3)
            limits = (axis.get_xlim(), axis.get_ylim(), axis.get_zlim())
            axis.set_box_aspect(np.ptp(limits, axis=1), zoom=0.75)
    drawn.colorbar(dots, ax=axes, shrink=0.8, label=colour_label(record, field))
    return drawn


def _draw_energies(times: Array, history: Mapping[str, Array]) -> Figure:
    drawn = Picture(figsize=(9.0, 4.5), layout="constrained")
    axis = drawn.subplots()
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
    return drawn
