"""Picture: a figure that notebooks show, and what is drawn in it."""

from __future__ import annotations

from io import BytesIO
from typing import Any, final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array


@final
class Picture(Figure):
    """A figure that shows itself in a notebook, whether or not pyplot is loaded there."""

    def _repr_png_(self) -> bytes:
        drawn = BytesIO()
        self.savefig(drawn, format="png", dpi=90)
        return drawn.getvalue()


def discs(places: Array, sizes: Array, axis: Axes, **look: Any) -> EllipseCollection:
    """Discs with their middles at `places` (n, 2) and diameters `sizes` (n,), in units of the axis.

    Args:
        places: of the middles.
        sizes: the diameters.
        axis: that they are to be added to.
        look: as of matplotlib's collections.
    """
    return EllipseCollection(
        sizes,
        sizes,
        np.zeros(len(sizes)),
        units="xy",
        edgecolors="none",
        offsets=places,
        offset_transform=axis.transData,
        **look,
    )
