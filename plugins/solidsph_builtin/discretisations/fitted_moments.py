"""Volumes fitted to the moments of the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles

# Samples of the surface along a spacing.
_SAMPLES = 4


@final
@attrs.frozen
class FittedMoments(Discretisation):
    """Another discretisation with the smallest change of its volumes that makes the body's volume,
    centre and second moments exact.

    A sum over the centres of n cells across a section gives 1 - 1/n^2 of its second moment, and
    one with points on its surface too much, so that a beam of five particles is some per cent too
    soft or too stiff for that reason alone. The smallest relative change that corrects this is
    V <- V (1 + a + b . X + X . C X).
    """

    of: Discretisation = attrs.field(metadata={"part": "discretisations"})

    example: ClassVar[Mapping[str, Any]] = {"of": "lattice"}

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """Particles of the wrapped discretisation with fitted volumes.

        Raises:
            SceneError: the fit would make a volume negative.
        """
        given = self.of.particles(shape, spacing)
        real = ~given.ghosts
        volumes = given.volumes.copy()
        volumes[real] = fitted_volumes(given.positions[real], volumes[real], shape, spacing)
        if not np.all(volumes > 0.0):
            raise SceneError(
                "discretisation 'fitted-moments': the body is too thin for positive volumes to "
                f"have its moments (least volume {volumes.min():.6g}); use a finer spacing, or the "
                "inner discretisation alone"
            )
        return attrs.evolve(given, volumes=volumes)


def fitted_volumes(positions: Array, volumes: Array, shape: Shape, spacing: float) -> Array:
    """Volumes (n,) of particles at `positions` (n, d) with the moments of `shape` up to the second.

    `spacing` [m] is that of the particles; samples of the surface are finer.
    """
    d = positions.shape[1]
    # About the centre, in units of the size, so that the equations are well scaled.
    centre = volumes @ positions / volumes.sum()
    scale = float(np.abs(positions - centre).max()) or 1.0
    X = (positions - centre) / scale
    upper = np.triu_indices(d)
    basis = np.hstack([np.ones((len(X), 1)), X, X[:, upper[0]] * X[:, upper[1]]])
    missing = _moments(shape, centre, scale, spacing / _SAMPLES) - volumes @ basis
    # Volume and centre first, then second moments by what is left of their functions, which is
    # zero along a direction with one or two layers of particles.
    fitted = volumes * (1.0 + _change(basis[:, : 1 + d], volumes, missing[: 1 + d]))
    gram = basis[:, : 1 + d].T @ (volumes[:, None] * basis[:, : 1 + d])
    along = np.linalg.lstsq(gram, basis[:, : 1 + d].T @ (volumes[:, None] * basis[:, 1 + d :]))[0]
    rest = basis[:, 1 + d :] - basis[:, : 1 + d] @ along
    left = missing[1 + d :] - (fitted - volumes) @ basis[:, 1 + d :]
    result: Array = fitted + volumes * _change(rest, volumes, left)
    return result


def _change(functions: Array, volumes: Array, missing: Array) -> Array:
    """The smallest relative change (n,) of the volumes that adds `missing` (k,) to the sums of
    `functions` (n, k), as far as any change can."""
    gram = functions.T @ (volumes[:, None] * functions)
    change: Array = functions @ np.linalg.lstsq(gram, missing, rcond=1e-10)[0]
    return change


def _moments(shape: Shape, centre: Array, scale: float, spacing: float) -> Array:
    """Integrals of 1, x_i and x_i x_j (i <= j) over the shape, x scaled about the centre [m^d].

    By the divergence theorem: a function f of degree k has div(f x) = (d + k) f.
    """
    surface = shape.surface(spacing)
    x = (surface.points - centre) / scale
    d = x.shape[1]
    upper = np.triu_indices(d)
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    normals = surface.area_vectors / sizes[:, None]
    flux = np.sum(x * surface.area_vectors, axis=1) * scale
    # A sample is an edge or a square, with a second moment about its own middle.
    edges = sizes ** (2.0 / max(d - 1, 1)) / scale**2 if d > 1 else np.zeros(len(x))
    own = (np.eye(d) - normals[:, :, None] * normals[:, None, :]) * edges[:, None, None] / 12.0
    second = x[:, upper[0]] * x[:, upper[1]] + own[:, upper[0], upper[1]]
    return np.concatenate([[flux.sum() / d], flux @ x / (d + 1), flux @ second / (d + 2)])
