"""Curves along a line, one for each cover of the kernel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from solidsph.maths.arrays import Array
from solidsph_cases.drawing.sheet import Mark, mark

# Distinct in grey: by dashes first, then by shade.
_FEW = 30  # particles whose marks do not run together
STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
_MARKERS = ("o", "s", "^", "D", "v", "x")

KEY: Mapping[str, Any] = {
    "title": "cover, in particle spacings (ps)",
    "title_fontsize": 9,
    "handlelength": 3.5,
}
"""The style of a legend of covers."""


def by_cover(curves: Mapping[float, tuple[Array, Array]]) -> list[Mark]:
    """Places and values (n,) by cover [spacings], marked at every particle where they are few."""
    return [
        mark(
            *("plot", x, values),
            color=f"{0.6 * (1.0 - (k + 1) / len(curves)):.3f}",
            linestyle=STYLES[k % len(STYLES)],
            marker=_MARKERS[k % len(_MARKERS)] if len(x) <= _FEW else "",
            markersize=4,
            linewidth=1.3,
            label=f"{cover:g} ps",
        )
        for k, (cover, (x, values)) in enumerate(curves.items())
    ]
