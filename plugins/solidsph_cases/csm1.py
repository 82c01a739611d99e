"""CSM1: an elastic beam behind a disc, at rest under gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs

from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph_cases._compare import compared
from solidsph_cases._scheme import check_count
from solidsph_cases._turek_hron import Clamp, beam, clamp_named, tip


@final
@attrs.frozen
class Csm1(Case):
    """A slender beam of Saint Venant-Kirchhoff material sags under its weight.

    It bends by a fifth of its length: small strains, large rotation. The corners of the clamp are
    singular, so that the error falls with about the first power of the spacing.
    """

    title: ClassVar[str] = "Turek and Hron's beam at rest (CSM1)"
    source: ClassVar[str] = "Turek & Hron (2006)"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (5, 9, 13, 17),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (2.2, 2.6, 3.0),
    }

    clamp: str = "arc"  # or "straight", whose reference is our own
    across: int = 5  # particles across the beam
    kernel: str = "cubic-spline"
    cover: float = number(default=3.0)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.0)  # strength [-]; 0 names none
    engine: str = "auto"
    load_steps: int = 1
    tolerance: float = number(default=0.005)  # largest error of the tip that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("csm1", "load_steps", self.load_steps, 1)
        clamp_named("csm1", self.clamp)
        check_count("csm1", "across", self.across, 3)
        check_positive("csm1", "tolerance", self.tolerance, "parts of one")

    @property
    def held(self) -> Clamp:
        """How the beam is held."""
        return clamp_named("csm1", self.clamp)

    def scenes(self) -> Mapping[str, Scene]:
        builder = beam(self.held, self.across, self).statics(load_steps=self.load_steps)
        return {"csm1": builder.title(self.title).duration(1.0).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["csm1"]
        return [
            compared(
                record,
                f"tip: u_{axis}",
                1e3 * u,
                "mm",
                1e3 * rest,
                self.held.source,
                self.tolerance,
            )
            for axis, u, rest in zip("xy", tip(record)[-1], self.held.rest, strict=True)
        ]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._beam_picture import draw_at_rest

        path = folder / "csm1.png"
        draw_at_rest(records["csm1"], self.held, self.title, path)
        return [path]
