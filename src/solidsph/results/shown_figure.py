"""A figure that a notebook shows."""

from __future__ import annotations

from io import BytesIO
from typing import final

from matplotlib.figure import Figure

_DPI = 100  # of the picture in a notebook


@final
class ShownFigure(Figure):
    """A figure of Matplotlib that shows itself in notebooks, whether pyplot is loaded or not."""

    def _repr_png_(self) -> bytes:
        """PNG file for notebooks."""
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=_DPI)
        return picture.getvalue()
