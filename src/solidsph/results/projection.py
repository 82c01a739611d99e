"""Views: places in space as they are seen on a page, by parallel projection."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array


@final
@attrs.frozen(eq=False)
class View:
    """A direction from which a scene is seen."""

    right: Array  # (3,) unit vector to the right of the page
    up: Array  # (3,) unit vector up the page
    toward: Array  # (3,) unit vector to the eye
    axes: tuple[str, str] | None = None  # coordinates along the page, if they are along its edges
    name: str = ""

    def flat(self, vectors: Array) -> Array:
        """Places or vectors (..., d) on the page, (..., 2) [m]."""
        d = vectors.shape[-1]
        return np.stack([vectors @ self.right[:d], vectors @ self.up[:d]], axis=-1)

    def nearness(self, vectors: Array) -> Array:
        """How far places or vectors (..., d) are in the direction of the eye, (...) [m]."""
        return np.asarray(vectors @ self.toward[: vectors.shape[-1]])


_X, _Y, _Z = np.eye(3)


def _slanted(toward: Array) -> View:
    """The view from a direction, with y upright."""
    toward = toward / np.linalg.norm(toward)
    right = np.cross(_Y, toward)
    right /= np.linalg.norm(right)
    return View(right, np.cross(toward, right), toward)


PAGE = View(_X, _Y, _Z, ("X", "Y"))
"""Of scenes in one and two dimensions."""

SLANTED = _slanted(np.array([-0.55, 0.5, 0.75]))
"""From the left, from above and from larger Z."""

UPRIGHT = (
    View(_X, _Y, _Z, ("X", "Y"), "along Z"),
    View(_X, _Z, -_Y, ("X", "Z"), "along Y"),
    View(_Z, _Y, -_X, ("Z", "Y"), "along X"),
)
"""Along the axes, each with coordinates that grow to the right and up."""
