"""Picture: a figure that notebooks show."""

from __future__ import annotations

from io import BytesIO
from typing import final

from matplotlib.figure import Figure


@final
class Picture(Figure):
    """A figure that shows itself in a notebook, whether or not pyplot is loaded there."""

    def _repr_png_(self) -> bytes:
        drawn = BytesIO()
        self.savefig(drawn, format="png", dpi=90)
        return drawn.getvalue()
