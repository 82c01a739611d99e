"""A body of which a piece starts inside out: there is nothing to compute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._energy import smallest_volume_ratio
from solidsph_cases._scheme import check_count, with_scheme


@final
@attrs.frozen
class InsideOut(Case):
    """A few particles in the middle start as their own mirror image, so that J = -1 there.

    The energy of the law is not defined for such a place: a run must say so at once, with the
    particle and its J, and not go on with numbers that mean nothing.
    """

    title: ClassVar[str] = "A piece inside out"
    source: ClassVar[str] = "psi holds ln J, which no J below 0 has"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {"particles": (7, 9)}
    trials: ClassVar[Mapping[str, Trial]] = {
        "a mirrored piece": Trial(must_fail="the law has no energy where matter is inside out")
    }

    particles: int = 9  # along each side
    size: float = number(default=1.6)  # half of the piece's side [spacings]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "quadratic"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"

    def __attrs_post_init__(self) -> None:
        check_count("inside-out", "particles", self.particles, 5)

    def scenes(self) -> Mapping[str, Scene]:
        spacing = 1.0 / (self.particles - 1)
        middle = spacing * (self.particles // 2)
        near = self.size * spacing
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "square",
                shape={"type": "box", "lengths": [1.0, 1.0]},
                spacing=spacing,
                discretisation={"type": "lattice", "on_boundary": True},
                tags={"piece": "*".join(f"(abs({axis} - {middle!r}) < {near!r})" for axis in "XY")},
            )
            .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
            .initial(where="piece", displacement={"x": f"-2*(X - {middle!r})"})
            .duration(0.1)
            .outputs(10)
        )
        return {"square": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [smallest_volume_ratio(records["square"])]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []
