"""Discretisation: how a shape becomes particles."""

from __future__ import annotations

from abc import abstractmethod

from solidsph.interfaces.part import Part
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles


class Discretisation(Part):
    """A shape and a spacing -> Particles.

    Promises, whatever the arrangement: volumes add up to the shape's, area vectors of a closed
    surface add up to zero, every named face of the shape becomes a tag, the same input gives the
    same bits.
    """

    @abstractmethod
    def particles(self, shape: Shape, spacing: float) -> Particles:
        """Discretise `shape` with particles about `spacing` [m] apart.

        Raises:
            SceneError: no particle fits, or the arrangement cannot represent the shape.
        """
