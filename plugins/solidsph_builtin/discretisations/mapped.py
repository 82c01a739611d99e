"""Mapped: particles of a simple shape, moved by a formula into a curved body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.fields import Component, VectorField
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations.points import Points

# Differences over this part of a spacing: their error is its square, 1e-8.
_RELATIVE_STEP = 1e-4

# Samples of the surface along a spacing, for the volume of a shape that does not know its own.
_SAMPLES = 8


@final
@attrs.frozen
class Mapped(Discretisation):
    """The particles of `of` in the shape `before`, moved `to` formulas of X, Y and Z.

    Rows of particles then follow a curved boundary and straighten smoothly towards the inside. A
    lattice that is cut or moved at the boundary has irregular neighbours instead, which costs a
    clamped beam one per cent. Components that `to` does not name do not change. The particles must
    lie in the shape of the body, and have its faces, not those of `before`.

    Volumes are multiplied by the Jacobian of the map, and scaled to that of the body.
    """

    of: Discretisation = attrs.field(metadata={"part": "discretisations"})
    before: Shape = attrs.field(metadata={"part": "shapes"})
    to: Mapping[str, Component]  # {x = "X + 0.1*Y**2"} [m]

    # The rectangle of the conformance kit, mapped to itself.
    example: ClassVar[Mapping[str, Any]] = {
        "of": "lattice",
        "before": {"type": "box", "lengths": [1.2, 0.8]},
        "to": {"x": "X + 0.05*sin(2*pi*X/1.2)"},
    }

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The moved particles.

        Raises:
            SceneError: the map turns a volume over, a particle leaves the shape, or `of` has
                ghosts, which have no place beyond a curved boundary.
        """
        d = shape.dimension
        field = VectorField.of(self.to, "discretisation 'mapped': to")
        field.check_dimension(d, "discretisation 'mapped': to")
        field.check_without("t", "particles are placed once, before the run: use X, Y and Z")
        if self.before.dimension != d:
            raise refusal(
                self, f"the shape has {d} dimensions, but `before` has {self.before.dimension}"
            )
        given = self.of.particles(self.before, spacing)
        if given.ghosts.any():
            raise refusal(self, f"`of` makes {given.ghosts.sum()} ghosts; set its ghosts to 0")
        ratios = _jacobian(field, given.positions, _RELATIVE_STEP * given.spacings)
        if not np.all(ratios > 0.0):
            worst = int(np.argmin(ratios))
            raise refusal(
                self,
                f"the map turns volumes over: its Jacobian is {ratios[worst]:.3g} at "
                f"X = {given.positions[worst].tolist()}; it must be positive everywhere",
            )
        volumes = ratios * given.volumes
        volumes *= _volume(shape, spacing) / volumes.sum()
        moved = Points(positions=_moved(field, given.positions), volumes=volumes)
        try:
            return moved.particles(shape, float(given.spacings[0]))
        except SceneError as cause:
            raise refusal(self, f"after the map, {cause}") from None

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """Where those of `of` do in `before`, whose surface the map takes to that of the body."""
        return self.of.ends_on_surface(self.before, spacing)


def _moved(field: VectorField, X: Array) -> Array:
    """Images of X (n, d) under the map [m]."""
    x = X.copy()
    for axis in field.components:
        x[:, axis] = field.values(axis, X, 0.0)
    return x


def _jacobian(field: VectorField, X: Array, steps: Array) -> Array:
    """Ratio of volumes after and before the map, (n,)."""
    columns = []
    for axis in np.eye(X.shape[1]):
        offset = steps[:, None] * axis
        columns.append(
            (_moved(field, X + offset) - _moved(field, X - offset)) / (2.0 * steps[:, None])
        )
    ratios: Array = np.linalg.det(np.stack(columns, axis=2))
    return ratios


def _volume(shape: Shape, spacing: float) -> float:
    """Volume of the shape, in closed form or by the divergence theorem [m^d]."""
    known = shape.volume()
    if known is not None:
        return known
    surface = shape.surface(spacing / _SAMPLES)
    return float(np.vdot(surface.points, surface.area_vectors)) / shape.dimension
