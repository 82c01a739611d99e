"""A body of which a piece starts inside out: there is nothing to compute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scene import SOFT, box, check_count, solid


@final
@attrs.frozen
class InsideOut(Case):
    """A few particles in the middle start as their own mirror image, so that J = -1 there.

    The energy of the law is not defined for such a place: a run must say so at once, with the
    particle and its J.
    """

    title = "A piece inside out"
    source = "psi holds ln J, which no J below 0 has"
    sweep = {"particles": (7, 9)}
    trials = {
        "a mirrored piece": Trial(must_fail="the law has no energy where matter is inside out")
    }

    particles: int = 9  # along each side
    size: float = number(default=1.6)  # half of the piece's side [spacings]

    def __attrs_post_init__(self) -> None:
        check_count("inside-out", "particles", self.particles, 5)

    def scenes(self) -> Mapping[str, Scene]:
        spacing = 1.0 / (self.particles - 1)
        middle = spacing * (self.particles // 2)
        near = self.size * spacing
        tags = {"piece": " and ".join(f"abs({axis} - {middle!r}) < {near!r}" for axis in "XY")}
        builder = (
            solid(self.title, "square", box(1.0, 1.0), spacing, SOFT, tags=tags)
            .initial(where="piece", displacement={"x": f"-2*(X - {middle!r})"})
            .duration(0.1)
            .outputs(10)
        )
        return {"square": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [smallest_volume_ratio(records["square"])]
