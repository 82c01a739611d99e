"""Lattice: particles in rows and columns."""

from __future__ import annotations

from collections.abc import Sequence

import attrs

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._cells import lattice_particles
from solidsph_builtin.discretisations._checks import check_ghosts, check_spacing, refusal
from solidsph_builtin.discretisations._grid import grid_over


@attrs.frozen
class Lattice(Discretisation):
    """A cubic lattice in the bounding box of the shape; the points inside the shape are particles.

    Particles are at the centres of the cells, or with `on_boundary` at their corners, so that the
    outermost are on the faces of the box. A spacing that does not divide a side of the box is
    changed along it to the nearest that does; `spacings` is the geometric mean over the axes.

    The volume of a particle is the part of the shape nearest to it: half a cell on a face with
    `on_boundary`, a quarter or an eighth on an edge or in a corner. The total is exact if the shape
    knows its volume. Particles are in the order of their coordinates, the axis with most of them
    fastest, ghosts after all others.

    `ghosts` is the number of layers of lattice points beyond the surface, in holes as well, or only
    behind some faces: `ghost_faces = ["left", "bottom"]` for those two and their corner. A ghost
    has the volume of a whole cell, and its mirror image in the surface as image.

    Tags: each face of the shape, `surface`, `interior` and `ghosts`; with ghosts also each face
    with `-ghosts` appended, for those nearest to it.

    Raises:
        SceneError: a parameter is of the wrong kind.
    """

    on_boundary: bool = attrs.field(default=False)
    ghosts: int = attrs.field(default=0)  # layers
    ghost_faces: Sequence[str] | None = None  # where there are ghosts; behind every face if None

    def __attrs_post_init__(self) -> None:
        if not isinstance(self.on_boundary, bool):
            raise refusal(self, f"on_boundary must be true or false, got {self.on_boundary!r}")
        check_ghosts(self, self.ghosts)

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The lattice points in the shape, and the ghosts.

        Raises:
            SceneError: the spacing is not positive, so large that no particle lies in the shape,
                or so small that there would be too many.
        """
        spacing = check_spacing(self, spacing)
        grid = grid_over(self, shape, spacing, on_boundary=self.on_boundary, beyond=self.ghosts)
        return lattice_particles(
            self, shape, grid, spacing, ghosts=self.ghosts, ghost_faces=self.ghost_faces
        )

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """True with `on_boundary` and without ghosts, as on the faces of a box."""
        return self.on_boundary and not self.ghosts
