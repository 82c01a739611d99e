"""Limit: what a quantity tends to as the spacing falls, in place of a reference."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import Any, final

import attrs


@final
@attrs.frozen
class Limit:
    """Estimated value of a quantity at spacing zero."""

    quantity: str
    value: float
    uncertainty: float  # of the value, as errors of its own scheme are concerned
    scale: float  # what errors are relative to: the largest magnitude of what was measured
    order: float  # observed; nan if there is none
    scheme: Mapping[str, Any]  # settings of the points that it is from, but for their spacing
    finest: float  # value of the finest of those points
    warning: str  # why it is not to be relied on; empty if it is
    in_sight: bool = True  # whether the values tend to it; else it is the finest one

    @property
    def bar(self) -> float:
        """Estimated error of the finest value, relative to the scale."""
        return self._relative(abs(self.finest - self.value) + self.uncertainty)

    def error(self, value: float, settings: Mapping[str, Any]) -> float:
        """Estimated error of a value, relative to the scale.

        Results of one scheme err together, so that for them the limit counts as less uncertain than
        it is, by less than the error of the finest value. For those of others that error is added.

        Args:
            value: of the quantity.
            settings: with which it was found.
        """
        own = all(settings.get(name) == setting for name, setting in self.scheme.items())
        off = abs(value - self.value)
        return self._relative(off + self.uncertainty) + (0.0 if own else self.bar)

    def _relative(self, off: float) -> float:
        if not isfinite(off):
            return inf
        return off / self.scale if self.scale > 0.0 else 0.0
