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
