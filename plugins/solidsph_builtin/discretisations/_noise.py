"""Random displacements of particles that must stay in their shape."""

from __future__ import annotations

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph_builtin.discretisations._checks import refusal

# How often a displacement out of the shape is halved before the particle is left in place.
_ATTEMPTS = 8


def moved_inside(shape: Shape, points: Array, displacements: Array) -> Array:
    """`points` (n, d) plus `displacements` (n, d), those halved that leave the shape [m]."""
    moved = points + displacements
    scale = 1.0
    for attempt in range(_ATTEMPTS + 1):
        outside = (shape.signed_distance(moved) > 0.0).nonzero()[0]
        if not outside.size:
            break
        scale = 0.0 if attempt == _ATTEMPTS else 0.5 * scale
        moved[outside] = points[outside] + scale * displacements[outside]
    return moved


def check_noise(discretisation: Discretisation, amplitude: object, seed: object) -> None:
    """Refuse an amplitude at which particles could meet, and an invalid seed.

    Raises:
        SceneError: one of them is of the wrong kind or out of range.
    """
    if not (isinstance(amplitude, float) and 0.0 <= amplitude < 0.5):
        raise refusal(discretisation, f"amplitude must be in [0, 0.5) cells, got {amplitude!r}")
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise refusal(discretisation, f"seed must be a whole number of at least 0, got {seed!r}")
