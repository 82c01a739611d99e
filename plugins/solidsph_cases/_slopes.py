"""The slope of one known function by one gradient: what of interpolation is held against cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph_cases._line import LENGTH, F, Line, bare_line, complete_line
from solidsph_cases._scene import check_count

_COVERS = (1.5, 2.2, 2.5, 3.5, 5.5)


@final
@attrs.frozen
class SlopeOfQuartic(Case):
    """f' of (x - 1/2)^4 on (0, 1), without extra particles, so that its ends count."""

    title = "Slope of a quartic"
    source = "its derivative"
    sweep = {
        "cells": (10, 20, 40, 80, 160),
        "gradient": ("standard", "difference", "corrected", "quadratic"),
        "cover": _COVERS,
    }

    cells: int = 40  # spacings from 0 to 1
    kernel: str = "modified-mollifier"
    cover: float = number(default=2.5)  # [spacings]
    gradient: str = "quadratic"

    def __attrs_post_init__(self) -> None:
        check_count("interpolation", "cells", self.cells, 8)

    @property
    def resolution(self) -> float:
        return LENGTH / self.cells

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        line = bare_line(self.kernel, self.cover, self.cells, gradient=self.gradient)
        return [_missed(line, F(line.X), F.deriv()(line.X))]


@final
@attrs.frozen
class SlopeOfEdge(Case):
    """f' of an edge that falls smoothly over a fifth of (0, 1), with ghosts on either side."""

    title = "Slope of a falling edge"
    source = "its derivative"
    sweep = {
        "cells": (15, 31, 61, 121, 241),
        "gradient": ("standard", "corrected", "quadratic"),
        "cover": _COVERS,
    }

    cells: int = 61  # spacings from 0 to 1
    kernel: str = "modified-mollifier"
    cover: float = number(default=2.5)  # [spacings]
    gradient: str = "corrected"

    def __attrs_post_init__(self) -> None:
        check_count("falling-edge", "cells", self.cells, 8)

    @property
    def resolution(self) -> float:
        return LENGTH / self.cells

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        line = complete_line(self.kernel, self.cover, self.cells, gradient=self.gradient)
        width = 0.1
        s = (line.X - 0.5 * LENGTH) / width
        return [_missed(line, 0.5 * (1.0 - np.tanh(s)), -0.5 / width / np.cosh(s) ** 2)]


def _missed(line: Line, values: Array, slopes: Array) -> Measurement:
    """Root mean square error of the slope over (0, 1), over that of the true slope."""
    miss = (line.gradient @ values - slopes)[line.real]
    error = float(np.sqrt(np.mean(miss**2) / np.mean(slopes[line.real] ** 2)))
    quantity = "root mean square error of the slope, relative"
    return Measurement(quantity, error, "1", source="its derivative", error=error)
