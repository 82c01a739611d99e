"""CSM1: an elastic beam behind a disc, at rest under gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph_cases._compare import compared
from solidsph_cases._scene import check_all_positive, check_count
from solidsph_cases._turek_hron import Clamp, beam, beam_panel, clamp_named, stress_bar, tip
from solidsph_cases.drawing.sheet import Sheet, mark


@final
@attrs.frozen
class Csm1(Case):
    """A slender beam of Saint Venant-Kirchhoff material sags under its weight.

    It bends by a fifth of its length: small strains, large rotation. The corners of the clamp are
    singular, so that the error falls with about the first power of the spacing.
    """

    title = "Turek and Hron's beam at rest (CSM1)"
    source = "Turek & Hron (2006)"
    sweep = {
        "across": (5, 9, 13, 17),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (2.2, 2.6, 3.0),
    }

    clamp: str = "arc"  # or "straight", whose reference is our own
    across: int = 5  # particles across the beam
    load_steps: int = 1
    tolerance: float = number(default=0.005)  # largest error of the tip that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("csm1", "load_steps", self.load_steps, 1)
        clamp_named("csm1", self.clamp)
        check_count("csm1", "across", self.across, 3)
        check_all_positive("csm1", self, tolerance="parts of one")

    @property
    def held(self) -> Clamp:
        """How the beam is held."""
        return clamp_named("csm1", self.clamp)

    def scenes(self) -> Mapping[str, Scene]:
        builder = beam(self.title, self.held, self.across).statics(load_steps=self.load_steps)
        return {"csm1": builder.duration(1.0).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record, held = records["csm1"], self.held
        return [
            compared(
                record, f"tip: u_{axis}", 1e3 * u, "mm", 1e3 * rest, held.source, self.tolerance
            )
            for axis, u, rest in zip("xy", tip(record)[-1], held.rest, strict=True)
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The bent beam, coloured by stress, with the published place of its tip."""
        record = records["csm1"]
        rest = np.array(self.held.rest)
        end = record.particles.positions[record.particles.tagged("tip")].mean(axis=0) + rest
        (u_x, u_y), (x, y) = 1e3 * tip(record)[-1], 1e3 * rest
        arrow = {"arrowstyle": "-", "color": "0.5", "relpos": (1.0, 0.5), "shrinkB": 8.0}
        cross = {"linestyle": "", "marker": "+", "markersize": 14}
        body = beam_panel(
            *(record, -1, self.held, f"{self.title}: {record.particles.count} particles"),
            mark("plot", *end, color="white", markeredgewidth=4.0, **cross),
            mark("plot", *end, color="black", markeredgewidth=1.6, **cross),
            mark(
                "annotate",
                f"tip: u = ({u_x:.3f}, {u_y:.2f}) mm\nreference (+): ({x:.3f}, {y:.2f}) mm",
                end,
                xytext=(0.04, 0.07),
                textcoords="axes fraction",
                fontsize=10,
                arrowprops=arrow,
            ),
        )
        return {"csm1": Sheet([[body]], (9.0, 4.4), bars=[stress_bar(body)])}
