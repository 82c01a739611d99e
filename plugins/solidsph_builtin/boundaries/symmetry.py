"""A plane of symmetry normal to an axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.compilable_terms import LinearExtension
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, Plane, marks_of
from solidsph.interfaces.terms import Observation, Term
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import VectorField
from solidsph.registry.parameters import number
from solidsph_builtin.boundaries._images import interpolation
from solidsph_builtin.boundaries._imposed import imposed_motion
from solidsph_builtin.boundaries._reports import COMPONENTS, reaction

# A particle this close to the plane, in spacings, lies on it.
_ON_PLANE = 1e-6
# Particles this close are beside it, and so large a part of these must lie on it.
_BESIDE, _ENOUGH = 0.5, 0.5


@final
@attrs.frozen
class Symmetry(BoundaryHandler):
    """Mirror symmetry about the plane {axis} = {at}; the body may lie on either side of it.

    Ghosts beyond the plane, such as those of `ghost_faces = ["left"]`, move as mirror images and
    complete the supports; particles on the plane stay on it. There must be ghosts or particles on
    the plane. Without ghosts, particles on the plane have half a support: unless the gradient
    takes the surface into account, as 'consistent' does, stresses beside a hole on the plane are a
    third too high.
    """

    axis: str
    at: float = number(default=0.0)  # [m]

    example: ClassVar[Mapping[str, Any]] = {"axis": "x"}

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles = model.particles
        names = COMPONENTS[: particles.dimension]
        if self.axis not in names:
            raise SceneError(
                f"symmetry: unknown axis {self.axis!r}; this scene has {', '.join(names)}"
            )
        normal = names.index(self.axis)
        height = particles.positions[:, normal] - self.at
        on_plane = np.flatnonzero(~particles.ghosts & (np.abs(height) < _on_plane_tolerance(model)))
        beyond = _ghosts_of(model, normal, self.at)
        if not len(beyond):
            self._check_held(height[~particles.ghosts], particles.spacings[~particles.ghosts])
        if not len(on_plane) and not len(beyond):
            raise SceneError(
                f"symmetry: no particle lies on the plane {self.axis} = {self.at:.6g} m and no "
                "ghost beyond it; give the discretisation ghosts behind that face, ghosts = N as "
                "many as the cover and ghost_faces = [its name]; with gradient = 'consistent', "
                "particles on the plane (on_boundary = true) do as well"
            )
        terms: list[Term] = []
        if len(on_plane):
            terms.append(imposed_motion(model, label, on_plane, VectorField({normal: 0.0})))
        if len(beyond):
            X, images = particles.positions[beyond], particles.images[beyond]
            terms.append(
                Mirror(
                    label=label,
                    ghosts=beyond,
                    shape=particles.positions.shape,
                    images=interpolation(particles, images),
                    # Beyond a corner of two planes a ghost is mirrored in both.
                    signs=np.where(np.abs(X - images) > _on_plane_tolerance(model), -1.0, 1.0),
                    reports=not terms,
                )
            )
        return terms

    def _check_held(self, heights: Array, spacings: Array) -> None:
        """Raise SceneError if the plane runs through a body whose particles are not on it.

        They are above it by `heights` (n,) [m], with their `spacings` (n,) [m].
        """
        beside = np.abs(heights) < _BESIDE * spacings
        on_plane = np.abs(heights) < _ON_PLANE * spacings.min()
        through = min(-heights.min(), heights.max()) > spacings.min()
        if through and on_plane.sum() < _ENOUGH * beside.sum():
            raise SceneError(
                f"symmetry: the plane {self.axis} = {self.at:.6g} m runs through the body, and "
                f"{on_plane.sum()} of {beside.sum()} particles beside it lie on it; cut the body "
                "there, so that one side is left (the shape 'difference' with a box), or hold "
                "other places, by a clamp of one axis"
            )

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        held = tuple(marks_of(self.bind(model, label), model.particles, model.end))
        if held:
            return held
        particles = model.particles
        direction = np.eye(particles.dimension)[COMPONENTS.index(self.axis)]
        # The normal points to the side of the body, whatever that is.
        side = np.sign(particles.positions[~particles.ghosts].mean(axis=0) @ direction - self.at)
        return (Plane(self.at * direction, side * direction),)


def _on_plane_tolerance(model: DiscreteModel) -> float:
    return _ON_PLANE * float(model.particles.spacings.min())


def _ghosts_of(model: DiscreteModel, normal: int, at: float) -> Indices:
    """Ghosts that are mirror images in the plane; beyond a corner, in the first plane."""
    particles = model.particles
    tolerance = _on_plane_tolerance(model)
    X, images = particles.positions, particles.images
    moved = np.abs(X - images) > tolerance
    mirrored_here = moved[:, normal] & (np.abs(0.5 * (X + images)[:, normal] - at) < tolerance)
    return np.flatnonzero(particles.ghosts & mirrored_here & ~moved[:, :normal].any(axis=1))


@final
@attrs.frozen(eq=False)
class Mirror(LinearExtension):
    """Ghosts as mirror images: u = R u, T = R T R with R the reflection."""

    label: str
    ghosts: Indices  # (k,)
    shape: tuple[int, ...]  # (n, d)
    images: csr_array  # (k, n)
    signs: Array  # (k, d) the diagonals of R
    reports: bool  # the reaction of the plane, unless the particles on it report it

    @property
    def displacement(self) -> csr_array:
        return self.images

    @property
    def stress(self) -> csr_array:
        return self.images

    def report(self, observation: Observation) -> Mapping[str, float]:
        return reaction(observation, self.label) if self.reports else {}
