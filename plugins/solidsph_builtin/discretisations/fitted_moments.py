"""Volumes and areas that integrate polynomials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations._fitting import fitted
from solidsph_builtin.discretisations._graded_fitting import graded_fit


@final
@attrs.frozen
class FittedMoments(GradedDiscretisation):
    """Another discretisation with volumes, and areas of particles on the boundary, that integrate
    polynomials of the second degree.

    The volume of a particle is the integral of the function that it has in a moving least squares
    fit, and its area is that over the surface. On a lattice with particles on the boundary these
    are the weights of Gregory's rule, 3/8, 7/6, 23/24, 1 from a face inwards. With cells that the
    surface cuts, a beam of five particles is some per cent too soft or too stiff, and so is a
    twisted bar with thirteen.

    Particles deeper inside than these functions reach keep their volumes. What curved surfaces
    leave of the body's volume, centre and second moments is corrected by the smallest relative
    change, V <- V (1 + a + b . X + X . C X).
    """

    of: Discretisation = attrs.field(metadata={"part": "discretisations"})

    example: ClassVar[Mapping[str, Any]] = {"of": "lattice"}

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """Particles of the wrapped discretisation with fitted volumes and areas.

        Raises:
            SceneError: the fit would make a volume negative.
        """
        return fitted(self, shape, spacing, self.of.particles(shape, spacing))

    def graded_particles(self, shape: Shape, spacing: SpacingField) -> Particles:
        """The same where the spacing varies, if the wrapped discretisation can follow it.

        Raises:
            SceneError: as of `particles`, or the wrapped one cannot.
        """
        if not isinstance(self.of, GradedDiscretisation):
            raise refusal(self, "the spacing varies, which `of` does not follow; use 'points'")
        return graded_fit(self, shape, spacing, self.of.graded_particles(shape, spacing))

    def own_spacing(self, shape: Shape) -> SpacingField | None:
        """That of the wrapped discretisation."""
        return self.of.own_spacing(shape) if isinstance(self.of, GradedDiscretisation) else None

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """Where those of the wrapped discretisation do."""
        return self.of.ends_on_surface(shape, spacing)
