"""FilteredLaw: a law with the stress of a filter of the dilatation."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.law import Law
from solidsph.maths.arrays import Array
from solidsph.model.dilatation_filter import DilatationFilter


@final
@attrs.frozen(eq=False)
class FilteredLaw(Law):
    """The stress of a law, and that of a filter of the dilatation of all particles."""

    body: Body
    own: Law
    filter: DilatationFilter

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        stress, history = self.own.flux(H, history, step)
        real = np.where(self.body.particles.ghosts[:, None, None], 0.0, H)
        added = self.filter.stress(np.eye(H.shape[1]) + real)
        return stress + np.moveaxis(added, 0, -1), history
