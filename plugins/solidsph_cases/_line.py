"""A line of particles, its sums as matrices, and the function that they interpolate."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from typing import Any

import attrs
import numpy as np
from numpy.polynomial import Polynomial
from scipy.sparse import csr_array

from solidsph.engines.matrix import operators
from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.simulation import Simulation
from solidsph_cases._scene import ON_BOUNDARY

LENGTH = 1.0  # of the range that is looked at [m]

# Ismail & Reddy, section 3, after Zhang & Batra (2004).
F = Polynomial([-0.5, 1.0]) ** 4

_JITTER = 0.25  # of an irregular line [spacings]


@attrs.frozen(eq=False)
class Line:
    """Particles along X in rising order, with the matrices of Ismail & Reddy, eqs. 8 and 10."""

    X: Array  # (n,) [m]
    real: Mask  # (n,) whether it is no ghost
    spacing: float  # [m]
    kernel: SmoothingKernel
    smoothing: csr_array  # (n, n), <f> = W f
    gradient: csr_array  # (n, n), <df/dX> = X_1 f [1/m]
    model: DiscreteModel  # of the same particles, in its own order
    order: Indices  # (n,) where they are in it


def complete_line(
    kernel: str, cover: float, cells: int, *, gradient: str = "standard", supports: int = 2
) -> Line:
    """Particles from 0 to 1, on both ends, with ghosts beyond as far as so many supports.

    By default they are enough for a gradient of a gradient.
    """
    ghosts = supports * ceil(cover)
    arrangement = {**ON_BOUNDARY, "ghosts": ghosts}
    return line(kernel, cover, LENGTH / cells, arrangement, gradient=gradient)


def bare_line(kernel: str, cover: float, cells: int, *, gradient: str = "standard") -> Line:
    """The same without extra particles; the first and the last have half a cell each."""
    return line(kernel, cover, LENGTH / cells, ON_BOUNDARY, gradient=gradient)


def whole_line(kernel: str, cover: float, cells: int) -> Line:
    """The same with a whole cell for each particle, the first and the last too."""
    given = {
        "type": "points",
        "positions": np.linspace(0.0, LENGTH, cells + 1)[:, None],
        "volumes": np.full(cells + 1, LENGTH / cells),
    }
    return line(kernel, cover, LENGTH / cells, given)


def irregular_line(kernel: str, cover: float, cells: int, *, seed: int, own_cells: bool) -> Line:
    """Particles off the places of a lattice by up to a quarter of a spacing, without ghosts.

    With `own_cells` each weighs what part of the line is nearest to it, so that sums are
    trapezoidal rules; without, all weigh the same.
    """
    noise = np.random.default_rng(seed).uniform(-_JITTER, _JITTER, cells - 1)
    X = LENGTH / cells * (np.arange(cells + 1) + np.concatenate([[0.0], noise, [0.0]]))
    middles = 0.5 * (X[1:] + X[:-1])
    own = np.diff(middles, prepend=X[0], append=X[-1])
    volumes = own if own_cells else np.full(cells + 1, LENGTH / cells)
    given = {"type": "points", "positions": X[:, None], "volumes": volumes}
    return line(kernel, cover, LENGTH / cells, given)


def line(
    kernel: str,
    cover: float,
    spacing: float,
    discretisation: Mapping[str, Any],
    *,
    gradient: str = "standard",
) -> Line:
    """The interval (0, 1), discretised; the sums are those of a scene, which is never run."""
    builder = (
        Simulation.builder()
        .body(
            "line",
            shape={"type": "interval", "length": LENGTH},
            spacing=spacing,
            discretisation=discretisation,
        )
        .kernel(kernel, cover=cover)
        .material("linear-elastic", youngs_modulus=1.0, poissons_ratio=0.0, density=1.0)
        .formulation("total-lagrangian", gradient=gradient, divergence="plain")
        .engine("matrix")
        .duration(1.0)
    )
    if "ghosts" in discretisation:
        builder = builder.boundary("ghost-extension")
    model = builder.build().model
    (body,) = model.bodies
    # Ghosts come after all others.
    order = np.argsort(model.particles.positions[:, 0])
    return Line(
        X=model.particles.positions[order, 0],
        real=~model.particles.ghosts[order],
        spacing=spacing,
        kernel=body.smoothing,
        smoothing=csr_array(model.smoothing_matrix()[order][:, order]),
        gradient=csr_array(operators(body, body.pairs()).gradient[order][:, order]),
        model=model,
        order=order,
    )


def left_by_the_cut(line: Line) -> tuple[float, float]:
    """How much <x'> and <1> depend on whether neighbours at just the support radius count.

    Rounding decides that; it shows only if the kernel is cut where it is not zero.
    """
    H = line.kernel.support_radius
    within = np.array([np.nextafter(H, 0.0)])
    slope = 2.0 * H * line.spacing * abs(float(line.kernel.slope(within)[0]))
    return slope, 2.0 * line.spacing * float(line.kernel.value(within)[0])


def check_covers(case: str, covers: object) -> None:
    """Raise SceneError unless `covers` are some numbers of spacings, each with neighbours."""
    if not isinstance(covers, (list, tuple)) or not covers:
        raise SceneError(f"case {case!r}: covers must be a list of numbers, got {covers!r}")
    for cover in covers:
        if isinstance(cover, bool) or not isinstance(cover, (int, float)) or not 1.0 < cover <= 20:
            raise SceneError(
                f"case {case!r}: a cover must be more than 1 and at most 20 spacings, got {cover!r}"
            )
