"""Jittered: another discretisation with random displacements inside the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations._noise import check_noise, moved_inside
from solidsph_builtin.discretisations.points import nearest_volumes
from solidsph_builtin.shapes._checks import as_number


@final
@attrs.frozen
class Jittered(Discretisation):
    """The particles of `of`, with random displacements of those that own no surface.

    With `conforming-lattice`, for example, this arrangement has no rows and still follows the
    boundary. Along each axis the displacement is uniform in [-amplitude, amplitude] spacings; one
    that would leave the shape is halved until it does not. The volume of a particle is the part of
    the shape nearest to it, scaled to the former total volume; areas and tags do not change.

    Raises:
        SceneError: a parameter is of the wrong kind or out of range.
    """

    of: Discretisation = attrs.field(metadata={"part": "discretisations"})
    amplitude: float = attrs.field(converter=as_number)  # in spacings, 0 <= amplitude < 1/2 [-]
    seed: int  # of the random numbers: the same seed gives the same particles

    example: ClassVar[Mapping[str, Any]] = {"of": "lattice", "amplitude": 0.2, "seed": 1}

    def __attrs_post_init__(self) -> None:
        check_noise(self, self.amplitude, self.seed)

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The displaced particles.

        Raises:
            SceneError: `of` has ghosts, which would no longer be images of particles.
        """
        given = self.of.particles(shape, spacing)
        if given.ghosts.any():
            raise refusal(self, f"`of` makes {given.ghosts.sum()} ghosts; set its ghosts to 0")
        inside = np.ones(given.count, dtype=np.bool_)
        for face in given.faces.values():
            inside[face.particles] = False
        noise = np.random.default_rng(self.seed).uniform(-1.0, 1.0, given.positions.shape)
        steps = self.amplitude * given.spacings[inside, None] * noise[inside]
        positions = given.positions.copy()
        positions[inside] = moved_inside(shape, positions[inside], steps)
        volumes = nearest_volumes(self, shape, positions, spacing)
        volumes *= given.volumes.sum() / volumes.sum()
        return attrs.evolve(
            given, positions=positions, images=positions.copy(), volumes=volumes, cells=volumes
        )

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """Where those of `of` do: particles that own a surface stay."""
        return self.of.ends_on_surface(shape, spacing)
