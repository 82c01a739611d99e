"""Discretisation: how a shape is divided into particles."""

from __future__ import annotations

from abc import abstractmethod

from solidsph.interfaces.part import Part
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles


class Discretisation(Part):
    """A rule that turns a shape and a spacing into particles.

    For every arrangement the volumes add up to that of the shape, the area vectors of a closed
    surface add up to zero, every named face of the shape becomes a tag, and the same input gives
    the same bits.
    """

    @abstractmethod
    def particles(self, shape: Shape, spacing: float) -> Particles:
        """Discretise `shape` into particles about `spacing` [m] apart.

        Raises:
            SceneError: no particle fits, or the arrangement cannot represent the shape.
        """

    @abstractmethod
    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """Whether the outermost particles stand on the surface of `shape`, to a tenth of a
        `spacing` [m], without ghosts beyond it.

        A scheme asks before it chooses a gradient: the sums of some suit particles that end on the
        surface, those of others particles half a spacing inside. Most of the surface counts. A
        lattice, which follows no curved surface, answers as for a box. The answer must not take
        much longer than reading the parameters.

        Raises:
            SceneError: a parameter on which the answer depends is wrong.
        """
