"""GradedDiscretisation: particles whose spacing varies from place to place."""

from __future__ import annotations

from abc import abstractmethod

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField


class GradedDiscretisation(Discretisation):
    """A discretisation that can follow a spacing that varies."""

    @abstractmethod
    def graded_particles(self, shape: Shape, spacing: SpacingField) -> Particles:
        """Discretise `shape` into particles about as far apart as the `spacing` where they are,
        which is also what their `spacings` say.

        Raises:
            SceneError: as of `particles`.
        """

    def own_spacing(self, shape: Shape) -> SpacingField | None:
        """The spacing that the particles come with, for bodies with `spacing = "given"`; None, the
        default, if they follow what the scene says.

        Raises:
            SceneError: it cannot be read, or does not suit a body.
        """
        return None
