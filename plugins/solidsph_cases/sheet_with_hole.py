"""A sheet with a hole, pulled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._scheme import check_count, with_scheme
from solidsph_cases._sheet import (
    EXTENSION,
    MATERIAL,
    PEAK,
    SOURCE,
    at_hole,
    cells,
    check_hole,
    extensions,
    half_square,
    is_known,
    pushed,
)

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
    Rows of particles follow the hole: a lattice with a square hole is mapped onto the sheet, fading
    into itself towards the edges.

    Rubber is nearly incompressible, and its pressure sees neighbours that move against each other:
    with the quadratic gradient the stress above the hole zigzags from particle to particle. With
    the consistent one and hourglass control a few per cent of that are left, away from the hole.
    """

    title: ClassVar[str] = "A sheet with a hole, pulled"
    source: ClassVar[str] = "Ismail & Reddy, section 5.4, at rest; Kirsch (1898) for small loads"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "spacing": (0.2, 0.1, 0.05, 1.0 / 30.0),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (2.2, 2.6, 3.0),
    }

    hole_ratio: float = number(default=0.2)  # radius of the hole over W
    spacing: float = number(default=0.05)  # of particles [m]
    width: float = number(default=1.0)  # W, half the side of the sheet [m]
    traction: float = number(default=5e6)  # on the undeformed edge [Pa]
    kernel: str = "modified-mollifier"
    cover: float = number(default=3.0)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    load_steps: int = 1
    tolerance: float = number(default=0.01)  # largest error of the displacement that passes [-]
    peak_tolerance: float = number(default=0.05)  # largest error of a stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("sheet-with-hole", "load_steps", self.load_steps, 1)
        for name, unit in (("width", "m"), ("spacing", "m"), ("traction", "Pa")):
            check_positive("sheet-with-hole", name, getattr(self, name), unit)
        check_hole("sheet-with-hole", self.hole_ratio, self.width, self.spacing)

    @property
    def radius(self) -> float:
        """Of the hole [m]."""
        return self.hole_ratio * self.width

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The stress at (0, a), which is harder to come by than the displacement."""
        return super().accuracy(measurements[1:2])

    def scenes(self) -> Mapping[str, Scene]:
        W = self.width
        builder = with_scheme(
            Simulation.builder()
            .title(self.title)
            .body(
                "sheet",
                shape={
                    "type": "difference",
                    "of": _square(W),
                    "minus": {"type": "disc", "radius": self.radius},
                },
                spacing=W / cells(W, self.spacing),
                discretisation={"type": "fitted-moments", "of": self._rows()},
            )
            .material(
                "neo-hookean",
                youngs_modulus=MATERIAL.youngs_modulus,
                poissons_ratio=MATERIAL.poissons_ratio,
                density=MATERIAL.density,
            )
            .boundary("symmetry", axis="x")
            .boundary("symmetry", axis="y")
            .boundary("traction", where="right", traction={"x": self.traction})
            .boundary("traction", where="left", traction={"x": -self.traction})
            .duration(1.0)
            .statics(load_steps=self.load_steps),
            self,
        )
        return {"sheet": builder.scene()}

    def _rows(self) -> Mapping[str, Any]:
        """The lattice around a square hole, its rows moved outwards or inwards to the round one."""
        W, count = self.width, cells(self.width, self.spacing)
        half = half_square(self.hole_ratio, count) * W / count
        return {
            "type": "mapped",
            "of": {"type": "lattice", "on_boundary": True},
            "before": {"type": "difference", "of": _square(W), "minus": _square(half)},
            "to": pushed(W, self.radius, half),
        }

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["sheet"]
        W, S = self.width, self.traction
        extension = float(extensions(record)[-1]) / W
        stress = largest_principal(record.field("cauchy_stress")[-1])
        known = is_known(self.hole_ratio, S)
        top = at_hole(record, self.radius, 90.0)
        measured = [
            compared(
                record,
                "mean u_x of the loaded edge over W",
                extension,
                "1",
                EXTENSION if known else None,
                SOURCE,
                self.tolerance,
            ),
            compared(
                record,
                "largest principal Cauchy stress at (0, a)",
                1e-6 * stress[top],
                "MPa",
                1e-6 * PEAK if known else None,
                SOURCE,
                self.peak_tolerance,
            ),
            compared(
                record,
                "that over the largest anywhere",
                stress[top] / stress.max(),
                "1",
                1.0,
                "the peak is at (0, a)",
                self.peak_tolerance,
            ),
        ]
        small_load = _SMALL_LOAD * MATERIAL.youngs_modulus
        if self.hole_ratio <= _SMALL_HOLE and small_load >= S:
            stresses, theory = around_hole(record, S)
            measured.append(
                compared(
                    record,
                    "stress along the hole at (0, a) over the traction",
                    hoop_stress(record)[top] / S,
                    "1",
                    3.0,
                    _KIRSCH,
                    _KIRSCH_TOLERANCE,
                )
            )
            miss = float(np.sqrt(np.mean((stresses - theory) ** 2))) / 3.0
            measured.append(
                Measurement(
                    quantity="root mean square miss around the hole, over the peak",
                    value=miss,
                    unit="1",
                    reference=0.0,
                    source=_KIRSCH,
                    error=miss,
                    passed=record.outcome == FINISHED and miss <= _KIRSCH_TOLERANCE,
                )
            )
        return measured

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._sheet_picture import draw_sheet

        path = folder / "sheet-with-hole.png"
        draw_sheet(
            records["sheet"], self.measure(records)[1], self.radius, self.width, self.title, path
        )
        return [path]


def _square(half: float) -> Mapping[str, Any]:
    """A square around the origin."""
    return {"type": "box", "lengths": [2.0 * half, 2.0 * half], "origin": [-half, -half]}


def around_hole(record: Record, traction: float) -> tuple[Array, Array]:
    """Stress along the hole at its particles (k,), and Kirsch's, both over the traction [-]."""
    rim = record.particles.tagged("rim")
    x, y = record.particles.positions[rim].T
    return hoop_stress(record)[rim] / traction, 1.0 - 2.0 * np.cos(2.0 * np.arctan2(y, x))


def hoop_stress(record: Record) -> Array:
    """Cauchy stress along circles around the middle at the end, (n,) [Pa]."""
    x, y = record.particles.positions.T
    along = np.stack([-y, x], axis=1) / np.hypot(x, y)[:, None]
    sigma = record.field("cauchy_stress")[-1]
    hoop: Array = np.einsum("ni,nij,nj->n", along, sigma, along)
    return hoop
