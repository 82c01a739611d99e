"""A sheet with a hole, pulled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement
from solidsph_cases._compare import compared, vanishing
from solidsph_cases._scene import check_all_positive, check_count
from solidsph_cases._sheet import (
    EXTENSION,
    MATERIAL,
    PEAK,
    SOURCE,
    at_hole,
    check_hole,
    extensions,
    is_known,
    sheet,
    whole,
)
from solidsph_cases.drawing.fields import LARGEST_STRESS, circle, field, principal_stress
from solidsph_cases.drawing.sheet import BELOW, Bar, Panel, Sheet, line, mark

# So small is a load under which the sheet is linear, and a hole to which its edges are far.
_SMALL_LOAD = 1e-3  # of Young's modulus
_SMALL_HOLE = 0.101  # of the half width
_KIRSCH = "Kirsch (1898), an infinite linear sheet: sigma = S (1 - 2 cos 2 theta) at the hole"
_KIRSCH_TOLERANCE = 0.1  # at three or four particles to the radius of so small a hole


@final
@attrs.frozen
class SheetWithHole(Case):
    """A square sheet of rubber with a round hole in its middle, pulled at two edges until at rest.

    Its quarter has the side W and the hole the radius a. The whole sheet is computed: the peak at
    (0, a) lies on a plane of symmetry, where sums over half a support would be at their worst.
    """

    title = "A sheet with a hole, pulled"
    source = "Ismail & Reddy, section 5.4, at rest; Kirsch (1898) for small loads"
    sweep = {
        "spacing": (0.2, 0.1, 0.05, 1.0 / 30.0),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (2.2, 2.6, 3.0),
    }

    hole_ratio: float = number(default=0.2)  # radius of the hole over W
    spacing: float = number(default=0.05)  # of particles [m]
    width: float = number(default=1.0)  # W, half the side of the sheet [m]
    traction: float = number(default=5e6)  # on the undeformed edge [Pa]
    load_steps: int = 1
    tolerance: float = number(default=0.01)  # largest error of the displacement that passes [-]
    peak_tolerance: float = number(default=0.05)  # largest error of a stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("sheet-with-hole", "load_steps", self.load_steps, 1)
        check_all_positive("sheet-with-hole", self, width="m", spacing="m", traction="Pa")
        check_hole("sheet-with-hole", self.hole_ratio, self.width, self.spacing)

    @property
    def radius(self) -> float:
        """Of the hole [m]."""
        return self.hole_ratio * self.width

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The stress at (0, a), which is harder to come by than the displacement."""
        return super().accuracy(measurements[1:2])

    def scenes(self) -> Mapping[str, Scene]:
        builder = (
            sheet(
                title=self.title,
                square=whole,
                hole_ratio=self.hole_ratio,
                width=self.width,
                spacing=self.spacing,
            )
            .boundary("traction", where="right", traction={"x": self.traction})
            .boundary("traction", where="left", traction={"x": -self.traction})
            .duration(1.0)
            .statics(load_steps=self.load_steps)
        )
        return {"sheet": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["sheet"]
        W, S = self.width, self.traction
        stress = largest_principal(record.field("cauchy_stress")[-1])
        known = is_known(self.hole_ratio, S)
        top = at_hole(record, self.radius, 90.0)
        extension = float(extensions(record)[-1]) / W
        peak = record.at([[0.0, self.radius]], output=-1).stress
        compare = partial(compared, record, tolerance=self.peak_tolerance)
        measured = [
            compared(
                record,
                "mean u_x of the loaded edge over W",
                *(extension, "1", EXTENSION if known else None, SOURCE, self.tolerance),
            ),
            compare(
                "largest principal Cauchy stress at (0, a)",
                *(
                    1e-6 * float(largest_principal(peak)[0]),
                    "MPa",
                    1e-6 * PEAK if known else None,
                    SOURCE,
                ),
            ),
            compare(
                "that over the largest anywhere",
                *(stress[top] / stress.max(), "1", 1.0, "the peak is at (0, a)"),
            ),
        ]
        if self.hole_ratio <= _SMALL_HOLE and _SMALL_LOAD * MATERIAL.youngs_modulus >= S:
            stresses, theory = around_hole(record, S)
            miss = float(np.sqrt(np.mean((stresses - theory) ** 2))) / 3.0
            measured += [
                compared(
                    record,
                    "stress along the hole at (0, a) over the traction",
                    *(float(peak[0, 0, 0]) / S, "1", 3.0, _KIRSCH, _KIRSCH_TOLERANCE),
                ),
                vanishing(
                    record,
                    "root mean square miss around the hole, over the peak",
                    *(miss, _KIRSCH_TOLERANCE, _KIRSCH),
                ),
            ]
        return measured

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The deformed sheet, and the stress on the line from the hole to the upper edge."""
        record, W, a = records["sheet"], self.width, self.radius
        stress = principal_stress(record, -1)
        edge = W * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        before = {"color": "0.4", "linewidth": 1.0}
        body = Panel(
            field(record, -1, stress),
            mark("plot", *circle(a), ":", **before),
            mark("plot", *edge.T, ":", **before),
            title="deformed; dotted: before",
            x="x [m]",
            y="y [m]",
        )
        X, Y = record.particles.positions.T
        above = np.flatnonzero((np.abs(X) < 0.1 * float(record.particles.spacings[0])) & (Y > 0.0))
        above = above[np.argsort(Y[above])]
        marks = [
            mark("axvspan", 0.0, a / W, color="0.9"),
            mark(
                *("annotate", "hole", (0.5 * a / W, 0.04)),
                xycoords=("data", "axes fraction"),
                ha="center",
                rotation=90,
            ),
            line(Y[above] / W, stress[above], "ko-", ms=4, label="particles on X = 0"),
        ]
        peak = self.measure(records)[1].reference
        if peak is not None:
            style = {"markersize": 12, "mfc": "none", "mec": "0.3", "mew": 1.8}
            marks.append(line(a / W, peak, "s", label=f"reference peak: {peak:.2f} MPa", **style))
        profile = Panel(
            *marks,
            x="Y / W",
            y=f"{LARGEST_STRESS} [MPa]",
            xlim=(0.0, 1.02),
            ylim=(0.0, None),
            legend={"loc": "upper right"},
        )
        title = f"{self.title}: {record.particles.count} particles"
        bars = [Bar(f"{LARGEST_STRESS} [MPa]", [body], BELOW)]
        rows = [[body, profile]]
        return {"sheet-with-hole": Sheet(rows, (11.0, 6.0), title, widths=(1.1, 1.0), bars=bars)}


def around_hole(record: Record, traction: float) -> tuple[Array, Array]:
    """Stress along the hole at its particles (k,), and Kirsch's, both over the traction [-]."""
    rim = record.particles.tagged("rim")
    x, y = record.particles.positions[rim].T
    return _hoop_stress(record)[rim] / traction, 1.0 - 2.0 * np.cos(2.0 * np.arctan2(y, x))


def _hoop_stress(record: Record) -> Array:
    """Cauchy stress along circles around the middle at the end, (n,) [Pa]."""
    x, y = record.particles.positions.T
    along = np.stack([-y, x], axis=1) / np.hypot(x, y)[:, None]
    return np.asarray(np.einsum("ni,nij,nj->n", along, record.field("cauchy_stress")[-1], along))
