"""How the marks of boundaries, effects and probes are drawn into a view of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, final

import attrs
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull, cKDTree

from solidsph.interfaces.marks import Arrows, Held, Mark, Plane
from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import Particles
from solidsph.results.named_places import NamedPlace
from solidsph.results.projection import View
from solidsph.scene.scene_data import ProbeScene

COLOURS = ("#cb181d", "#6a51a3", "#006d2c", "#d94801", "#08519c", "#ae017e")
"""Of what is imposed, one for each label in turn."""

_LONGEST = 0.12  # of arrows, over the size of the bodies
_ACROSS = 14  # arrows along the longest side, at most
_ACROSS_VOLUME = 4  # the same where they fill a body
_ROUNDING = 1e-6
_THICKNESS = 0.03  # of planes as they are drawn, over the size of the bodies
_IN_FRONT = 3.0  # drawn after the particles
_FAINT = 0.35  # of what is on a far side


@final
@attrs.define(eq=False)
class Painter:
    """Draws marks into one view, and knows how much room they take."""

    axis: Axes
    view: View
    particles: Particles
    size: float  # of the bodies [m]
    _reached: list[Array] = attrs.field(factory=list)  # corners of what was drawn, (k, 2)

    @classmethod
    def on(cls, axis: Axes, view: View, particles: Particles) -> Painter:
        """A painter of the scene of these particles."""
        real = particles.positions[~particles.ghosts]
        size = max(float(np.ptp(real, axis=0).max()), float(particles.spacings.max()))
        return cls(axis, view, particles, size)

    def include(self, points: Array) -> None:
        """Leave room for points of the page (k, 2)."""
        if len(points):
            self._reached.append(np.stack([points.min(axis=0), points.max(axis=0)]))

    def limits(self) -> tuple[Array, Array]:
        """Lower and upper corner of all that was drawn, (2,) each."""
        corners = np.concatenate(self._reached)
        return corners.min(axis=0), corners.max(axis=0)

    def draw(self, mark: Mark, colour: str) -> None:
        """Draw one mark."""
        if isinstance(mark, Held):
            self._draw_held(mark)
        elif isinstance(mark, Arrows):
            self._draw_arrows(mark, colour)
        elif isinstance(mark, Plane):
            self._draw_plane(mark)
        else:
            self._draw_lines(mark.ends, colour, _IN_FRONT)

    def draw_probe(self, probe: ProbeScene, *, named: bool) -> None:
        """Draw a probe at a point or along a line; the others have no place of their own."""
        if probe.point is not None:
            points = np.atleast_2d(np.asarray(probe.point, dtype=np.float64))
        elif probe.line is not None:
            ends = [np.atleast_1d(probe.line[end]) for end in ("from", "to")]
            points = np.array(ends, dtype=np.float64)
        else:
            return
        flat = self.view.flat(points)
        self.axis.plot(*flat.T, "kx--", markersize=7, markeredgewidth=1.6, linewidth=0.8, zorder=5)
        self.include(flat)
        if named:
            self.axis.annotate(
                str(probe.label),
                tuple(flat.mean(axis=0)),
                (6, 6),
                textcoords="offset points",
                fontsize=8,
                zorder=6,
                bbox=_PAPER,
            )

    def write(self, named: NamedPlace) -> None:
        """Write a name beside the place that it names, outside of the body."""
        way = self.view.flat(named.outward)
        length = float(np.linalg.norm(way))
        far = float(self.view.nearness(named.outward)) < -0.05
        slant = way / length if length > 0.2 else np.zeros(2)
        if self.particles.dimension == 1:
            slant = np.array([0.0, 1.0])  # beside the line, where loads are not
        self.axis.annotate(
            named.name,
            tuple(self.view.flat(named.place)),
            tuple(14.0 * slant),
            textcoords="offset points",
            ha=_side(float(slant[0]), ("right", "center", "left")),
            va=_side(float(slant[1]), ("top", "center", "bottom")),
            fontsize=8,
            color="0.5" if far else "#08306b" if named.is_face else "#7f2704",
            style="normal" if named.is_face else "italic",
            zorder=6,
            bbox=_PAPER,
        )

    @staticmethod
    def legend_of(label: str, mark: Mark, colour: str) -> Iterator[Line2D]:
        """The entry of a mark in the legend."""
        if isinstance(mark, Held):
            axes = np.flatnonzero(mark.freedoms.any(axis=0))
            along = ", ".join("xyz"[axis] for axis in axes)
            count = int(mark.freedoms.any(axis=1).sum())
            marker = "+" if len(axes) > 1 else "|" if axes[0] == 1 else "_"
            text = f"{label}: {count:,} held in {along}"
            yield Line2D([], [], linestyle="", marker=marker, color="k", label=text)
        elif isinstance(mark, Arrows):
            largest = float(np.linalg.norm(mark.vectors, axis=1).max(initial=0.0))
            when = "" if mark.time is None else f" at t = {mark.time:.4g} s"
            text = f"{label}: {mark.quantity}, largest {largest:.4g} {mark.unit}{when}"
            marker = r"$\rightarrow$"
            yield Line2D([], [], linestyle="", marker=marker, ms=11, color=colour, label=text)
        elif isinstance(mark, Plane):
            yield Line2D([], [], linestyle="-", linewidth=4, color="0.6", label=f"{label}: plane")
        else:
            text = f"{label}: {len(mark.ends):,} links"
            yield Line2D([], [], color=colour, label=text)

    def _draw_held(self, held: Held) -> None:
        """A dash along each direction in which a particle is held."""
        particles, d = self.particles, self.particles.dimension
        outside = ~particles.ghosts
        if d == 3:
            outside = outside & particles.area_vectors.any(axis=1)
        for axis in range(d):
            chosen = np.flatnonzero(held.freedoms[:, axis] & outside)
            half = np.zeros((len(chosen), d))
            half[:, axis] = 0.4 * particles.spacings[chosen]
            X = particles.positions[chosen]
            near = self._near(particles.area_vectors[chosen])
            ends = np.stack([X - half, X + half], axis=1)
            self._draw_lines(ends[near], "k", _IN_FRONT + 0.1)
            self._draw_lines(ends[~near], "k", _IN_FRONT, _FAINT)

    def _draw_arrows(self, arrows: Arrows, colour: str) -> None:
        lengths = np.linalg.norm(arrows.vectors, axis=1)
        largest = float(lengths.max(initial=0.0))
        if not largest > 0.0:
            return
        normals = self._normals(arrows.places)
        filling = bool((np.abs(normals).sum(axis=1) == 0.0).any())
        chosen = self._spread(arrows.places, _ACROSS_VOLUME if filling else _ACROSS)
        chosen = chosen[lengths[chosen] > 1e-3 * largest]
        X, normals = arrows.places[chosen], normals[chosen]
        v = arrows.vectors[chosen] * (_LONGEST * self.size / largest)
        # A push ends at the surface, a pull begins there.
        pushing = np.sum(v * normals, axis=1) < 0.0
        tails = X - np.where(pushing & (not filling), 1.0, 0.0)[:, None] * v
        near = self._near(normals) | filling
        flat, way = self.view.flat(tails), self.view.flat(v)
        for these, alpha in ((near, 1.0), (~near, _FAINT)):
            self.axis.quiver(
                *flat[these].T,
                *way[these].T,
                angles="xy",
                scale_units="xy",
                scale=1.0,
                units="dots",
                width=1.8,
                headwidth=5.0,
                headlength=6.0,
                headaxislength=5.5,
                color=colour,
                alpha=alpha,
                zorder=_IN_FRONT + 0.5,
            )
        self.include(flat)
        self.include(flat + way)

    def _draw_plane(self, plane: Plane) -> None:
        """A slab behind the plane, as wide as the bodies."""
        d = len(plane.normal)
        corner, normal = np.zeros(max(d, 2)), np.zeros(max(d, 2))
        corner[:d], normal[:d] = plane.point, plane.normal
        centre = np.zeros(max(d, 2))
        real = self.particles.positions[~self.particles.ghosts]
        centre[:d] = 0.5 * (real.min(axis=0) + real.max(axis=0))
        foot = centre - ((centre - corner) @ normal) * normal
        across = np.linalg.svd(normal[None])[2][1:]  # unit vectors in the plane
        half = (0.05 if d == 1 else 0.6) * self.size
        steps = np.stack(np.meshgrid(*[[-half, half]] * len(across)), axis=-1)
        sides = foot + steps.reshape(-1, len(across)) @ across
        flat = self.view.flat(np.concatenate([sides, sides - _THICKNESS * self.size * normal]))
        outline = flat[ConvexHull(flat).vertices]
        style: dict[str, Any] = {"facecolor": "0.85", "edgecolor": "0.5", "linewidth": 0.8}
        self.axis.add_patch(Polygon(outline, zorder=0.5, alpha=0.7, hatch="////", **style))
        self.include(outline)

    def _draw_lines(self, ends: Array, colour: str, zorder: float, alpha: float = 1.0) -> None:
        """Straight lines (m, 2, d)."""
        if len(ends):
            lines = LineCollection(
                list(self.view.flat(ends)),
                colors=colour,
                linewidths=0.9,
                zorder=zorder,
                alpha=alpha,
            )
            self.axis.add_collection(lines)

    def _near(self, normals: Array) -> Mask:
        """Whether surfaces with these normals (k, d) face the eye, or are seen edge-on, (k,)."""
        length = np.linalg.norm(normals, axis=1)
        return np.asarray(self.view.nearness(normals) >= -0.05 * length)

    def _normals(self, places: Array) -> Array:
        """Outward direction at the particles that are at `places` (k, d), 0 inside."""
        _, owners = cKDTree(self.particles.positions).query(places)
        return np.asarray(self.particles.area_vectors[owners])

    def _spread(self, places: Array, across: int) -> Array:
        """Numbers of evenly spread places: in order, each that is far enough from those before."""
        apart = (1.0 - _ROUNDING) * self.size / across
        tree, free, chosen = cKDTree(places), np.ones(len(places), dtype=np.bool_), []
        for place in np.lexsort(np.round(places / self.size, 9).T[::-1]):
            if free[place]:
                chosen.append(place)
                free[tree.query_ball_point(places[place], apart)] = False
        return np.array(chosen)


_PAPER = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7}


def _side(component: float, sides: tuple[str, str, str]) -> str:
    return sides[0] if component < -0.4 else sides[2] if component > 0.4 else sides[1]
