"""A sheet with a hole, pulled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isclose
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.builder import Builder
from solidsph.errors import SceneError
from solidsph.interfaces.case import Case, Measurement
from solidsph.parameters import check_positive, number
from solidsph.results.pictures import largest_principal
from solidsph.results.record import Record
from solidsph.scene import Scene
from solidsph_builtin.cases._compare import FINISHED, compared
from solidsph_builtin.cases._scheme import check_count, with_scheme

YOUNGS_MODULUS = 70e6  # [Pa]
POISSONS_RATIO = 0.49
DENSITY = 1000.0  # [kg/m^3]; plays no part at rest

# What finite elements give, where they were asked.
_RATIO, _TRACTION = 0.2, 5e6
_EXTENSION = 0.06506  # mean u_x of the loaded edge over W
_PEAK = 16.74e6  # largest principal Cauchy stress, at (0, a) [Pa]
_OURS = "finite elements of a quarter of the sheet, the same law and dead traction"

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
        if not 0.0 < self.hole_ratio <= 0.7:
            raise SceneError(
                "case 'sheet-with-hole': hole_ratio must lie between 0 and 0.7, got "
                f"{self.hole_ratio}: it is the radius of the hole over half the side of the sheet"
            )
        if self._half_square < 1:
            raise SceneError(
                f"case 'sheet-with-hole': a hole of radius {self.radius:.6g} m needs a spacing "
                f"below it, got {self.spacing:.6g} m; a third of it or less is sensible"
            )

    @property
    def radius(self) -> float:
        """Of the hole [m]."""
        return self.hole_ratio * self.width

    @property
    def _cells(self) -> int:
        """Of the lattice, from the middle to an edge."""
        return max(1, round(self.width / self.spacing))

    @property
    def _half_square(self) -> int:
        """Half the side of the square hole, in cells of the lattice.

        It goes around the round one: rows along its sides then keep their spacing at the middle,
        where the stresses are read, and come closer at its corners.
        """
        return round(self.hole_ratio * self._cells)

    def scenes(self) -> Mapping[str, Scene]:
        W = self.width
        builder = with_scheme(
            Builder()
            .title(self.title)
            .body(
                "sheet",
                shape={
                    "type": "difference",
                    "of": _square(W),
                    "minus": {"type": "disc", "radius": self.radius},
                },
                spacing=W / self._cells,
                discretisation={"type": "fitted-moments", "of": self._rows()},
            )
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=POISSONS_RATIO,
                density=DENSITY,
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
        W, half = self.width, self._half_square * self.width / self._cells
        size, distance = "max(abs(X), abs(Y))", "hypot(X, Y)"
        fading = f"({W!r} - {size})/{W - half!r}"
        factor = f"(1 + {fading}*({self.radius / half!r}*{size}/{distance} - 1))"
        return {
            "type": "mapped",
            "of": {"type": "lattice", "on_boundary": True},
            "before": {"type": "difference", "of": _square(W), "minus": _square(half)},
            "to": {"x": f"X*{factor}", "y": f"Y*{factor}"},
        }

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["sheet"]
        particles, W, S = record.particles, self.width, self.traction
        edge = particles.faces["right"]
        u = record.positions[-1] - particles.positions
        extension = float(edge.areas @ u[edge.particles, 0] / edge.areas.sum()) / W
        stress = largest_principal(record.field("cauchy_stress")[-1])
        known = isclose(self.hole_ratio, _RATIO) and isclose(S, _TRACTION)
        top = at_hole(record, self.radius, 90.0)
        measured = [
            compared(
                record,
                "mean u_x of the loaded edge over W",
                extension,
                "1",
                _EXTENSION if known else None,
                _OURS,
                self.tolerance,
            ),
            compared(
                record,
                "largest principal Cauchy stress at (0, a)",
                1e-6 * stress[top],
                "MPa",
                1e-6 * _PEAK if known else None,
                _OURS,
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
        if self.hole_ratio <= _SMALL_HOLE and S <= _SMALL_LOAD * YOUNGS_MODULUS:
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
        from solidsph_builtin.cases._sheet_picture import draw_sheet

        path = folder / "sheet-with-hole.png"
        draw_sheet(
            records["sheet"], self.measure(records)[1], self.radius, self.width, self.title, path
        )
        return [path]


def _square(half: float) -> Mapping[str, Any]:
    """A square around the origin."""
    return {"type": "box", "lengths": [2.0 * half, 2.0 * half], "origin": [-half, -half]}


def at_hole(record: Record, radius: float, degrees: float) -> int:
    """The particle nearest to that angle from the load's axis, on the hole."""
    angle = np.radians(degrees)
    place = radius * np.array([np.cos(angle), np.sin(angle)])
    return int(np.argmin(np.linalg.norm(record.particles.positions - place, axis=1)))


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
