"""Picture of a scene before it runs: bodies, particles, faces, and what is imposed and measured.

Solid bodies are seen along the three axes and from a corner; only particles of their surface are
drawn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from solidsph.maths.arrays import Array, Indices
from solidsph.model.particles import Particles
from solidsph.results.arrangement import Arrangement
from solidsph.results.mark_drawing import COLOURS, Painter
from solidsph.results.named_places import NamedPlace, named_places
from solidsph.results.picture import Picture, discs
from solidsph.results.projection import PAGE, SLANTED, UPRIGHT, View

_BODIES = ("#9ecae1", "#fdc086", "#b2df8a", "#cab2d6", "#fb9a99", "#d9d9d9")
_GHOSTS = "0.93"

# Diameter of a ball of the volume of a cube, in its sides; discs of plane bodies touch instead.
_BALL = 2.0 * (3.0 / (4.0 * np.pi)) ** (1.0 / 3.0)

_SHADE = 0.55  # brightness of a surface that is seen edge-on

_MANY = 5_000  # particles; more are drawn as pixels in files of vectors

_MARGIN = 0.08  # around the drawing, over its size

_LEGEND = 48  # characters of a line of the legend


def arrangement_figure(arrangement: Arrangement) -> Figure:
    """Draw a scene as it stands before it runs."""
    particles = arrangement.model.particles
    shown = _shown(particles)
    solid = particles.dimension == 3
    size = np.ptp(particles.positions[shown], axis=0)
    figure = Picture(figsize=_figure_size(size), layout="constrained")
    places = named_places(arrangement.model)
    panels = _solid_panels(figure, size) if solid else [(PAGE, figure.subplots())]
    for view, axis in panels:
        _draw(arrangement, view, axis, shown, places if view in (PAGE, SLANTED) else ())
    _write_legend(figure, arrangement)
    if arrangement.title:
        figure.suptitle(arrangement.title, fontsize=11)
    return figure


def _figure_size(size: Array) -> tuple[float, float]:
    if len(size) == 3:
        return 13.0, 7.5
    if len(size) == 1:
        return 12.0, 2.5
    return 12.0, float(np.clip(1.5 + 7.0 * float(size[1] / max(size[0], 1e-300)), 3.5, 9.0))


def _solid_panels(figure: Figure, size: Array) -> list[tuple[View, Axes]]:
    """A large slanted view, and beside it those along the axes."""
    heights = [float(np.ptp(view.flat(np.stack([0 * size, size]))[:, 1])) for view in UPRIGHT]
    ratios = np.maximum(heights, 0.3 * max(heights))
    grid = figure.add_gridspec(3, 2, width_ratios=[1.4, 1.0], height_ratios=list(ratios))
    slanted = (SLANTED, figure.add_subplot(grid[:, 0]))
    return [slanted, *((view, figure.add_subplot(grid[k, 1])) for k, view in enumerate(UPRIGHT))]


def _shown(particles: Particles) -> Indices:
    """Particles that are drawn: all, or in space those of the surface and bodies without one."""
    if particles.dimension < 3:
        return np.arange(particles.count)
    outside = ~particles.ghosts & particles.area_vectors.any(axis=1)
    for extent in particles.bodies.values():
        if not outside[extent].any():
            outside[extent] = ~particles.ghosts[extent]
    return np.flatnonzero(outside)


def _draw(
    arrangement: Arrangement, view: View, axis: Axes, shown: Indices, places: Sequence[NamedPlace]
) -> None:
    particles = arrangement.model.particles
    flat = view.flat(particles.positions[shown])
    reach = 0.5 * particles.spacings[shown].max()
    painter = Painter.on(axis, view, particles)
    _draw_particles(particles, view, axis, shown, flat)
    painter.include(np.stack([flat.min(axis=0) - reach, flat.max(axis=0) + reach]))
    for number, (_, marks) in enumerate(arrangement.marks.items()):
        for mark in marks:
            painter.draw(mark, COLOURS[number % len(COLOURS)])
    for probe in arrangement.probes:
        painter.draw_probe(probe, named=bool(places))
    for place in places:
        painter.write(place)
    low, high = painter.limits()
    margin = _MARGIN * float(np.max(high - low))
    axis.set(
        xlim=(low[0] - margin, high[0] + margin),
        ylim=(low[1] - margin, high[1] + margin),
        aspect="equal",
    )
    if view.axes is None:
        axis.set_axis_off()
        _draw_directions(axis, view)
        return
    axis.set_xlabel(f"{view.axes[0]} [m]")
    if particles.dimension == 1:
        axis.set_yticks([])
        axis.spines["left"].set_visible(False)
    else:
        axis.set_ylabel(f"{view.axes[1]} [m]")
    axis.set_title(view.name, fontsize=9)
    width, height = high - low
    axis.locator_params(axis="x", nbins=int(np.clip(6.0 * width / max(width, 2.0 * height), 2, 6)))
    axis.spines[["top", "right"]].set_visible(False)


def _draw_particles(
    particles: Particles, view: View, axis: Axes, shown: Indices, flat: Array
) -> None:
    """Discs of the size of the particles, the nearest to the eye last."""
    order = np.argsort(view.nearness(particles.positions[shown]), kind="stable")
    order = order[np.argsort(~particles.ghosts[shown][order], kind="stable")]  # ghosts below all
    chosen = shown[order]
    sizes = particles.spacings[chosen] * (_BALL if particles.dimension == 3 else 1.0)
    colours = np.empty((len(chosen), 3))
    for number, extent in enumerate(particles.bodies.values()):
        own = (chosen >= extent.start) & (chosen < extent.stop)
        colours[own] = to_rgb(_BODIES[number % len(_BODIES)])
    colours *= _brightness(particles, view, chosen)[:, None]
    colours[particles.ghosts[chosen]] = to_rgb(_GHOSTS)
    drawn = discs(flat[order], sizes, axis, facecolors=colours, zorder=2.0)
    drawn.set_rasterized(len(chosen) > _MANY)
    axis.add_collection(drawn)


def _brightness(particles: Particles, view: View, chosen: Indices) -> Array:
    """Brightness of surfaces, which shows the form of a body in space, (k,)."""
    if particles.dimension < 3:
        return np.ones(len(chosen))
    vectors = particles.area_vectors[chosen]
    lengths = np.linalg.norm(vectors, axis=1)
    facing = np.divide(
        view.nearness(vectors + 0.35 * lengths[:, None] * view.up),  # lit from above
        lengths,
        out=np.ones(len(chosen)),
        where=lengths > 0.0,
    )
    return np.asarray(_SHADE + (1.0 - _SHADE) * np.clip(facing, 0.0, 1.0))


def _draw_directions(axis: Axes, view: View) -> None:
    """The directions of the axes in a corner."""
    corner = (0.07, 0.07)
    for name, direction in zip("XYZ", np.eye(3), strict=True):
        tip = view.flat(direction) * 0.06
        end = (corner[0] + tip[0], corner[1] + tip[1])
        axis.annotate("", end, corner, "axes fraction", "axes fraction", {"arrowstyle": "->"})
        label = (corner[0] + 1.35 * tip[0], corner[1] + 1.35 * tip[1])
        axis.annotate(name, label, xycoords="axes fraction", ha="center", va="center", fontsize=8)


def _write_legend(figure: Figure, arrangement: Arrangement) -> None:
    handles = list(_handles(arrangement))
    for handle in handles:
        handle.set_label(fill(str(handle.get_label()), _LEGEND))
    figure.legend(handles=handles, loc="outside right center", fontsize=8, frameon=False)


def _handles(arrangement: Arrangement) -> Iterator[Line2D]:
    particles = arrangement.model.particles
    for number, (name, extent) in enumerate(particles.bodies.items()):
        real = ~particles.ghosts[extent]
        spacings = particles.spacings[extent]
        low, high = float(spacings.min()), float(spacings.max())
        apart = f"{low:.4g}" if high <= low * (1.0 + 1e-9) else f"{low:.4g} to {high:.4g}"
        text = f"{name}: {int(real.sum()):,} particles, {apart} m apart"
        colour = _BODIES[number % len(_BODIES)]
        yield Line2D([], [], linestyle="", marker="o", color=colour, label=text)
    if particles.ghosts.any():
        text = f"{int(particles.ghosts.sum()):,} ghosts"
        yield Line2D([], [], linestyle="", marker="o", color=_GHOSTS, label=text)
    for number, (label, marks) in enumerate(arrangement.marks.items()):
        for mark in marks:
            yield from Painter.legend_of(label, mark, COLOURS[number % len(COLOURS)])
        if not marks:
            yield Line2D([], [], linestyle="", label=label)
    for probe in arrangement.probes:
        placed = probe.point is not None or probe.line is not None
        text = f"{probe.label}: {probe.quantity}" + ("" if placed else f", {probe.place}")
        yield Line2D([], [], linestyle="", marker="x" if placed else "", color="k", label=text)
