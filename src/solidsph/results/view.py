"""View of a record in three dimensions, by PyVista: sliders for time and for the deformation."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import Any, final

import attrs
import numpy as np

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.results.pictures import colour_label, magnitudes
from solidsph.results.recorded import Recorded
from solidsph.system.progress_display import in_notebook

_SIZE = (1024, 768)  # of the window [pixels]

# The body takes this part of what it would fill, with its middle there, from -1 to 1.
_ZOOM, _CENTRE = 0.85, (0.15, -0.1)

_AXES = (0.0, 0.14, 0.16, 0.3)  # place of the small axes in the window, above the sliders

_RADIUS = 0.6  # of spheres [spacings]: a little more than that of touching ones, to hide gaps

_TITLE = 18  # letters of the colour bar's title in a line

_PICTURES = (".png", ".jpeg", ".jpg", ".bmp", ".tif", ".tiff")

# Positions of the sliders in the window, from its lower left corner.
_TIME = ((0.05, 0.08), (0.45, 0.08))
_DEFORMATION = ((0.55, 0.08), (0.95, 0.08))


@final
@attrs.define(eq=False)
class View:
    """What is shown: one output of a record, coloured by a field, with magnified displacements."""

    record: Recorded
    field: str
    output: int  # from the start
    factor: float  # of the displacements; 1 is the deformed body
    _real: Any = attrs.field(init=False)  # particles that are no ghosts, (n,) bool
    cloud: Any = attrs.field(init=False)  # the points that are shown
    _plotter: Any = attrs.field(init=False, default=None)

    def __attrs_post_init__(self) -> None:
        library = _library()
        self._real = ~self.record.particles.ghosts
        self.cloud = library.PolyData(self._points())
        self.cloud["colour"] = self._colours()
        self.cloud["spacing"] = self.record.particles.spacings[self._real]

    def show(self, picture: Path | None = None) -> None:
        """Open a window, or draw a picture without one.

        Raises:
            RecordError: there is no display, or the picture cannot be drawn.
        """
        if picture is not None:
            if picture.suffix.lower() not in _PICTURES:
                raise RecordError(
                    f"a picture ends in {', '.join(_PICTURES)}, got {str(picture)!r}; name it so"
                )
            _hush()
            plotter = self._scene(off_screen=True)
            picture.parent.mkdir(parents=True, exist_ok=True)
            plotter.screenshot(str(picture))
            plotter.close()
            return
        if in_notebook():  # PyVista shows what it can there, without a display a picture
            _hush()
        elif not _has_display():
            raise RecordError(
                "there is no display to open a window on; draw a file: --picture or picture=..."
            )
        plotter = self._scene(off_screen=False)
        plotter.add_slider_widget(
            self.to_time,
            rng=self._span(),
            value=self._time(),
            title="time [s]",
            pointa=_TIME[0],
            pointb=_TIME[1],
        )
        plotter.add_slider_widget(
            self.to_factor,
            rng=(0.0, max(2.0, 2.0 * self.factor)),
            value=self.factor,
            title="deformation",
            pointa=_DEFORMATION[0],
            pointb=_DEFORMATION[1],
        )
        plotter.show()

    def _scene(self, *, off_screen: bool) -> Any:
        plotter = _library().Plotter(off_screen=off_screen, window_size=_SIZE)
        plotter.set_background("white")
        low, high = self._range()
        actor = plotter.add_mesh(
            self.cloud,
            scalars="colour",
            clim=(low, high),
            cmap="cividis",
            style="points_gaussian",
            render_points_as_spheres=True,
            ambient=0.5,  # colours are to be read beside the bar
            scalar_bar_args={
                "title": fill(colour_label(self.record, self.field), _TITLE) + "\n",
                "title_font_size": 16,
                "label_font_size": 16,
                "n_labels": 5,
                "color": "black",
                "fmt": "%.3g",
                "vertical": True,
                "position_x": 0.85,
                "position_y": 0.25,
                "height": 0.5,
            },
        )
        actor.mapper.scale_array = "spacing"
        actor.mapper.scale_factor = _RADIUS
        radius = _RADIUS * float(self.record.particles.spacings.max())
        plotter.add_text(self._caption(), font_size=10, color="black", name="caption")
        plotter.add_axes(color="black", viewport=_AXES)
        if self.record.dimension < 3:
            plotter.view_xy()
        else:
            plotter.view_isometric()
        # Spheres reach beyond their centres; bar and sliders need room.
        points = self.cloud.points
        ends = np.stack([points.min(axis=0) - radius, points.max(axis=0) + radius], axis=1)
        camera = plotter.camera  # which PyVista resets when it is asked for the first time
        plotter.renderer.ResetCamera(*ends.ravel().tolist())
        camera.zoom(_ZOOM)
        camera.SetWindowCenter(*_CENTRE)
        camera.is_set = True
        self._plotter = plotter
        return plotter

    def to_time(self, time: float) -> None:
        """Show the output nearest to a time [s]."""
        self.output = int(np.abs(self.record.times - time).argmin())
        self._update()

    def to_factor(self, factor: float) -> None:
        """Show the displacements times a factor."""
        self.factor = factor
        self._update()

    def _update(self) -> None:
        self.cloud.points = self._points()
        self.cloud["colour"] = self._colours()
        if self._plotter is None:
            return
        self._plotter.add_text(self._caption(), font_size=10, color="black", name="caption")
        self._plotter.render()

    def _points(self) -> Array:
        """Current positions in space, with magnified displacements, (n, 3) [m]."""
        X = self.record.particles.positions[self._real]
        x = X + self.factor * (self.record.positions[self.output][self._real] - X)
        return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))

    def _colours(self) -> Array:
        return magnitudes(self.record.field(self.field)[self.output][self._real])

    def _range(self) -> tuple[float, float]:
        """Least and largest colour at the first, the shown and the last output."""
        series = self.record.field(self.field)
        some = [
            magnitudes(series[k][self._real]) for k in sorted({0, self.output, len(series) - 1})
        ]
        return min(float(v.min()) for v in some), max(float(v.max()) for v in some)

    def _span(self) -> tuple[float, float]:
        return float(self.record.times[0]), float(self.record.times[-1])

    def _time(self) -> float:
        return float(self.record.times[self.output])

    def _caption(self) -> str:
        magnified = "" if self.factor == 1.0 else f", displacements times {self.factor:.3g}"
        return f"t = {self._time():.4g} s{magnified}"


def view(
    record: Recorded,
    *,
    field: str = "cauchy_stress",
    time: float | None = None,
    factor: float = 1.0,
    picture: Path | str | None = None,
) -> None:
    """Show a record in a window with sliders for time and deformation, or draw a picture.

    Args:
        record: with at least one output.
        field: that colours the particles: a scalar, the length of a vector, or the largest
            principal value of a tensor.
        time: shown first, the nearest output; the last one by default [s].
        factor: of the displacements.
        picture: a file to draw instead of opening a window.

    Raises:
        RecordError: PyVista is not installed, there is no display to open a window on, the factor
            is no number, or the record has no output or no such field.
    """
    if not isfinite(factor):
        raise RecordError(f"displacements cannot be shown times {factor}; give a number such as 10")
    if not record.count:
        raise RecordError("the record holds no output yet, so there is nothing to show")
    output = record.count - 1 if time is None else int(np.abs(record.times - time).argmin())
    View(record, field, output, factor).show(None if picture is None else Path(picture))


def _library() -> Any:
    try:
        return import_module("pyvista")
    except ImportError:
        raise RecordError("PyVista is not installed; run: pip install 'solidsph[view]'") from None


def _has_display() -> bool:
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _hush() -> None:
    """Keep VTK from telling of displays that it has tried before it draws without one."""
    logger = import_module("vtkmodules.vtkCommonCore").vtkLogger
    logger.SetStderrVerbosity(logger.VERBOSITY_OFF)
