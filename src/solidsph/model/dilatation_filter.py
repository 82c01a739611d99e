"""DilatationFilter: what a nearly incompressible body does not resist of rough dilatations."""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.maths.arrays import Array
from solidsph.maths.dilatation import Dilatation
from solidsph.maths.tensors import components_first, particles_first
from solidsph.model.smooth_part import SmoothPart


@attrs.frozen(eq=False)
class DilatationFilter:
    """The energy kappa / 2 ((S theta)^2 - theta^2) per volume, with the smooth part S of the
    dilatation theta.

    With a law whose volumetric energy is lambda / 2 theta^2, smooth dilatations are resisted with
    lambda, and those of which S leaves nothing with lambda - kappa. Arguments F (n, d, d) are those
    of all particles of the body; F of ghosts is I.
    """

    dilatation: Dilatation
    smooth_part: SmoothPart
    modulus: float  # kappa [Pa]

    def energy_densities(self, F: Array) -> Array:
        """(n,) [J/m^3]."""
        theta = self._of(F)
        smooth = theta + self.smooth_part.change(theta)
        return np.asarray(0.5 * self.modulus * (smooth**2 - theta**2))

    def pressures(self, F: Array) -> Array:
        """q = kappa (S S theta - theta), (n,) [Pa], the stress that works on the dilatation."""
        return self._pressures(self._of(F))

    def slopes(self, F: Array) -> Array:
        """g = dtheta / dF, (n, d, d)."""
        with np.errstate(all="ignore"):  # a run that leaves the material's domain is caught later
            return particles_first(self.dilatation.slope(components_first(F)), len(F))

    def stress(self, F: Array) -> Array:
        """First Piola-Kirchhoff stress q g, (n, d, d) [Pa]."""
        return self.pressures(F)[:, None, None] * self.slopes(F)

    def change(self, F: Array, dF: Array) -> Array:
        """Change of that stress by dF (n, d, d)."""
        g = self.slopes(F)
        turned = self.pressures(F)[:, None, None] * self.bends(F, dF)
        return np.asarray(turned + self.coupled(g, dF))

    def coupled(self, g: Array, dF: Array) -> Array:
        """What of it comes from the change g : dF of the dilatations of all, at slopes g."""
        changes = self._pressures(np.einsum("pik,pik->p", g, dF))
        return np.asarray(changes[:, None, None] * g)

    def bends(self, F: Array, dF: Array) -> Array:
        """Change of the slopes (n, d, d) by dF (n, d, d)."""
        return particles_first(
            self.dilatation.bend(components_first(F), components_first(dF)), len(F)
        )

    @cached_property
    def matrix(self) -> csr_array:
        """kappa (S S - 1), (n, n) [Pa]."""
        change = self.smooth_part.matrix
        return csr_array(self.modulus * (2.0 * change + change @ change))

    def _pressures(self, theta: Array) -> Array:
        once = self.smooth_part.change(theta)
        return np.asarray(self.modulus * (once + once + self.smooth_part.change(once)))

    def _of(self, F: Array) -> Array:
        with np.errstate(all="ignore"):  # as above
            theta = np.asarray(self.dilatation.of(components_first(F)))
        return np.broadcast_to(theta, len(F))
