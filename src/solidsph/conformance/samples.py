"""Samples for checks: random deformations, particles without symmetry, differences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import wraps
from math import cos, sin
from typing import Any, TypeVar

import attrs
import numpy as np

from solidsph.errors import SceneError, SolidsphError
from solidsph.interfaces.material import Material
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array, Tensor
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.registry.construct import construct

Made = TypeVar("Made")

DIMENSIONS = (1, 2, 3)

# How many angles a rotation takes in 1, 2 and 3 dimensions.
ANGLES = {1: 0, 2: 1, 3: 3}

# Of the bodies on which gradients and divergences are checked.
CELLS = {1: (20,), 2: (9, 8), 3: (6, 5, 5)}
SPACING = 0.05  # [m]

_PLANES = ((0, 1), (1, 2), (2, 0))


def rotation(dimension: int, angles: Sequence[float]) -> Array:
    """Rotation matrix (d, d) from angles [rad]: none, one, or one in each coordinate plane."""
    Q = np.eye(dimension)
    for (i, j), angle in zip(_PLANES[: ANGLES[dimension]], angles, strict=True):
        turn = np.eye(dimension)
        turn[i, i] = turn[j, j] = cos(angle)
        turn[i, j], turn[j, i] = -sin(angle), sin(angle)
        Q = turn @ Q
    return Q


def deformation_gradient(stretches: Sequence[float], left: Array, right: Array) -> Array:
    """F = left diag(stretches) right^T (d, d), with det F the product of the stretches."""
    return left @ np.diag(stretches) @ right.T


def random_rotation(rng: np.random.Generator, dimension: int) -> Array:
    """Rotation (d, d) with each angle up to half a turn either way."""
    return rotation(dimension, rng.uniform(-np.pi, np.pi, ANGLES[dimension]).tolist())


def random_deformation_gradients(rng: np.random.Generator, dimension: int, count: int) -> Array:
    """(d, d, count), principal stretches of 0.7 to 1.4, so J is at least a third."""
    return np.stack(
        [
            deformation_gradient(
                rng.uniform(0.7, 1.4, dimension).tolist(),
                random_rotation(rng, dimension),
                random_rotation(rng, dimension),
            )
            for _ in range(count)
        ],
        axis=-1,
    )


def in_space(F: Array) -> Array:
    """F (d, d, n) as (3, 3, n), with the missing stretches 1."""
    whole = np.repeat(np.eye(3)[:, :, None], F.shape[2], axis=2)
    whole[: len(F), : len(F)] = F
    return whole


def as_tuples(A: Array) -> Tensor:
    """A matrix (d, d) as nested tuples of numbers."""
    return tuple(tuple(float(a) for a in row) for row in A)


def scattered(rng: np.random.Generator, cells: Sequence[int], spacing: float) -> Array:
    """A lattice over a box, each particle moved by up to a fifth of a spacing, (n, d) [m]."""
    axes = [np.arange(count) + 0.5 for count in cells]
    centres = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    return spacing * (centres + rng.uniform(-0.2, 0.2, centres.shape))


@attrs.frozen(eq=False)
class Body:
    """Scattered particles with free surfaces, and what a gradient is given of them."""

    positions: Array  # (n, d) [m]
    pairs: Pairs
    kernel_gradients: Array  # (m, d)
    volumes: Array  # (n,) [m^d]

    @classmethod
    def of(cls, positions: Array, volumes: Array, radius: float) -> Body:
        """Particles with the kernel of a scene that names none, with support `radius` [m]."""
        pairs = neighbour_pairs(positions, radius)
        kernel = construct("kernels", "modified-mollifier")
        W = smoothing_kernel(kernel, positions.shape[1], radius)
        return cls(positions, pairs, W.gradient(pairs.offsets, pairs.distances), volumes)


def bodies(cover: float, size: float = 1.0) -> Iterator[Body]:
    """Bodies in 1, 2 and 3D, with every length multiplied by `size`."""
    for d, rng in seeded():
        X, h = size * scattered(rng, CELLS[d], SPACING), size * SPACING
        yield Body.of(X, h**d * rng.uniform(0.9, 1.1, len(X)), cover * h)


def weights_problem(weights: Array, pairs: Pairs) -> str:
    """What is wrong with weight vectors of pairs; "" if nothing is."""
    expected = pairs.offsets.shape
    if weights.shape == expected and np.all(np.isfinite(weights)):
        return ""
    return f"weights {weights.shape}, pairs {expected}, or not finite"


def central_difference(f: Callable[[Array], Array], at: Array, along: Array, step: float) -> Array:
    """Derivative of f(at + e along) by e at e = 0, with an error of the sixth order in the step."""
    weights = {1: 45.0, 2: -9.0, 3: 1.0}
    change = [w * (f(at + k * step * along) - f(at - k * step * along)) for k, w in weights.items()]
    return np.asarray(sum(change) / (60.0 * step))


def stiffness(material: Material) -> float:
    """lambda + 2 mu, the scale of stresses [Pa]."""
    lam, mu = material.lame_parameters
    return lam + 2.0 * mu


def relative_error(material: Material, difference: Any) -> float:
    """The largest of differences of stresses or energy densities, over the stiffness [-]."""
    return float(np.abs(difference).max()) / stiffness(material)


def seeded() -> Iterator[tuple[int, np.random.Generator]]:
    """Each dimension with random numbers of its own, the same in every run."""
    for dimension in DIMENSIONS:
        yield dimension, np.random.default_rng(dimension)


def accepted(
    what: str,
    attempts: Iterable[tuple[str, Callable[[], Made]]],
    refusal: tuple[type[SolidsphError], ...] = (SceneError,),
) -> list[Made]:
    """Results of those attempts, each given with its name, that a part does not refuse.

    Args:
        what: what is attempted, for the message.
        attempts: functions that make a sample.
        refusal: errors that refuse one.

    Raises:
        SceneError: every attempt is refused.
    """
    made: list[Made] = []
    refusals: list[str] = []
    for name, make in attempts:
        try:
            made.append(make())
        except refusal as cause:
            refusals.append(f"{name}: {cause}")
    if not made:
        raise SceneError(f"every {what} is refused; the first, {refusals[0]}")
    return made


def kept_for_last(make: Callable[[Any], Made]) -> Callable[[Any], Made]:
    """`make` with its last result kept: a part's checks run one after the other."""
    kept: list[tuple[object, Made]] = []

    @wraps(make)
    def remembered(part: Any) -> Made:
        if not kept or kept[0][0] is not part:
            kept[:] = [(part, make(part))]
        return kept[0][1]

    return remembered
