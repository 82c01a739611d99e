"""Jittered lattice: particles displaced from the centres of their cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._cells import lattice_particles
from solidsph_builtin.discretisations._checks import check_ghosts, check_spacing
from solidsph_builtin.discretisations._grid import grid_over
from solidsph_builtin.discretisations._noise import check_noise, moved_inside
from solidsph_builtin.shapes._checks import as_number


@attrs.frozen
class JitteredLattice(Discretisation):
    """The particles of a lattice with random displacements, for tests without symmetry.

    Along each axis the displacement is uniform in [-amplitude, amplitude] cells; one that would
    leave the shape is halved until it does not. Volume and area of a particle are those of its
    cell; ghosts stay on the lattice, with their images. Tags are those of the lattice.

    Raises:
        SceneError: a parameter is of the wrong kind or out of range.
    """

    amplitude: float = attrs.field(converter=as_number)  # in cells, 0 <= amplitude < 1/2 [-]
    seed: int  # of the random numbers: the same seed gives the same particles
    ghosts: int = 0  # layers
    ghost_faces: Sequence[str] | None = None  # where there are ghosts; behind every face if None

    example: ClassVar[Mapping[str, Any]] = {"amplitude": 0.2, "seed": 1}

    def __attrs_post_init__(self) -> None:
        check_noise(self, self.amplitude, self.seed)
        check_ghosts(self, self.ghosts)

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The displaced particles and the ghosts.

        Raises:
            SceneError: the spacing is not positive, so large that no particle lies in the shape,
                or so small that there would be too many.
        """
        spacing = check_spacing(self, spacing)
        grid = grid_over(self, shape, spacing, beyond=self.ghosts)
        regular = lattice_particles(
            self, shape, grid, spacing, ghosts=self.ghosts, ghost_faces=self.ghost_faces
        )
        real = np.flatnonzero(~regular.ghosts)
        noise = np.random.default_rng(self.seed).uniform(-1.0, 1.0, (real.size, shape.dimension))
        moved = moved_inside(shape, regular.positions[real], self.amplitude * grid.steps * noise)
        positions, images = regular.positions.copy(), regular.images.copy()
        positions[real] = images[real] = moved
        return attrs.evolve(regular, positions=positions, images=images)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """False: they are at the centres of cells, and displaced."""
        return False
