"""A gradient by a kernel that is not symmetric."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs
from solidsph.registry.parameters import number
from solidsph_builtin.gradients.corrected import Corrected

_AXES = ("x", "y", "z")


@final
@attrs.frozen
class Skewed(Gradient):
    """The corrected gradient with neighbours ahead along an axis weighing more than those behind.

    Each weight is multiplied by 1 + skew cos(angle between the neighbour's offset and the axis):
    the "non-symmetric cover functions" of Ismail & Reddy, section 6, who expect upwinding from
    them. Linear fields stay exact. The case `upwinding` measures the effect: with the variational
    divergence, which is skewed the other way, no energy is lost and motions that alternate from
    particle to particle are resisted; with the plain one waves against the axis grow.
    """

    exact_degree: ClassVar[int] = 1

    skew: float = number(default=0.5)  # [-], 0 is the corrected gradient
    axis: str = "x"

    def __attrs_post_init__(self) -> None:
        if not -1.0 < self.skew < 1.0:
            raise SceneError(
                f"gradient 'skewed': skew must lie between -1 and 1, got {self.skew}, so that no "
                "weight changes its sign; 0.5 is a sensible value"
            )
        if self.axis not in _AXES:
            raise SceneError(f"gradient 'skewed': unknown axis {self.axis!r}; take x, y or z")

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        axis = _AXES.index(self.axis)
        if axis >= pairs.offsets.shape[1]:
            raise SceneError(
                f"gradient 'skewed': axis {self.axis!r} in a {pairs.offsets.shape[1]}D scene; take "
                "an axis of the scene"
            )
        safe = np.where(pairs.distances > 0.0, pairs.distances, 1.0)
        factor = 1.0 + self.skew * pairs.offsets[:, axis] / safe
        return Corrected().weights(pairs, factor[:, None] * kernel_gradients, volumes)
