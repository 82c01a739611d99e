"""Lead: what a step predicted, linear in its change, beside what it reached."""

from __future__ import annotations

import attrs

from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Lead:
    """By how much the prediction of a step is ahead of where it ended."""

    stress: Array  # (n, d, d) of the second Piola-Kirchhoff stress [Pa]
    stretch: Array  # (n,) factor of F that gives the predicted volume [-]

    def of(self, extent: slice) -> Lead:
        """That of one body's particles."""
        return Lead(self.stress[extent], self.stretch[extent])
