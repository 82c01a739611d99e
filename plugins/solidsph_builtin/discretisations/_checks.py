"""Checks of the input of discretisations."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from numbers import Real

from solidsph.errors import SceneError
from solidsph.interfaces.discretisation import Discretisation

MOST_PARTICLES = 5e7


def refusal(discretisation: Discretisation, reason: str) -> SceneError:
    """The error to raise when a discretisation cannot represent a shape."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", type(discretisation).__name__).lower()
    return SceneError(f"discretisation {words!r}: {reason}")


def check_spacing(discretisation: Discretisation, spacing: object) -> float:
    """`spacing` [m] as a float.

    Raises:
        SceneError: it is not a positive finite number.
    """
    number = isinstance(spacing, Real) and not isinstance(spacing, bool)
    if not (number and 0.0 < spacing < math.inf):  # type: ignore[operator]
        raise refusal(
            discretisation, f"spacing must be a positive finite length in m, got {spacing!r}"
        )
    return float(spacing)  # type: ignore[arg-type]


def check_count(discretisation: Discretisation, count: float) -> None:
    """Refuse to make more particles than any run could use.

    Raises:
        SceneError: `count` is beyond `MOST_PARTICLES`.
    """
    if not count <= MOST_PARTICLES:
        raise refusal(
            discretisation,
            f"this spacing needs a lattice of {count:.3g} points, at most {MOST_PARTICLES:.0e} are "
            "allowed; use a larger spacing, or check the unit of the shape",
        )


def check_faces(
    discretisation: Discretisation, wanted: Sequence[str], known: Sequence[str]
) -> None:
    """Refuse faces that the shape does not have.

    Raises:
        SceneError: one of `wanted` is not among the `known`.
    """
    for face in wanted:
        if face not in known:
            faces = ", ".join(dict.fromkeys(known))
            raise refusal(
                discretisation, f"ghost_faces: the shape has no face {face!r}; it has {faces}"
            )


def check_ghosts(discretisation: Discretisation, ghosts: object) -> None:
    """Refuse a number of ghost layers that is not a whole number of at least 0.

    Raises:
        SceneError: it is not.
    """
    if not isinstance(ghosts, int) or isinstance(ghosts, bool) or ghosts < 0:
        raise refusal(
            discretisation,
            f"ghosts must be a whole number of layers, 0 for none, got {ghosts!r}",
        )
