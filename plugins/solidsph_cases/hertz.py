"""A round foot is pressed on a rigid plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import nan, pi, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_builtin.materials.linear_elastic import LinearElastic
from solidsph_cases._compare import compared
from solidsph_cases._scene import check_all_positive, check_count, solid
from solidsph_cases.drawing.fields import scatter
from solidsph_cases.drawing.sheet import Bar, Panel, Sheet, level, line

RADIUS = 1.0  # R, of the foot [m]
MATERIAL = LinearElastic(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)

# The half width of the block and its height, in half-widths of the contact: stresses at the far
# sides are then below a fiftieth of the peak.
_BLOCK = 8.0
# Half-width of the contact that is aimed at [m], a tenth of R: where Hertz's parabola and small
# strains hold.
_HALF_WIDTH = 0.1 * RADIUS
# Motion of the top that brings it about, over that half-width.
_APPROACH = 0.15

_TOLERANCE = 0.05
_SOURCE = "Hertz (1882): a^2 = 4 P R / (pi E*), p0 = 2 P / (pi a)"


@final
@attrs.frozen
class Hertz(Case):
    """The lower side of a long block has the radius R; its top is moved down until the foot is
    flat over a tenth of R, in plane strain and in equilibrium.

    Particles lie on the round side. The load P is what the plane carries; half-width and peak
    pressure come from the parabola that fits the squares of the pressures
    p^2 = p0^2 (1 - x^2 / a^2) best. Against an elastic half-plane the block is finite, which
    changes the pressures by less than a hundredth. One half is simulated.
    """

    title = "A round foot on a rigid plane"
    source = _SOURCE
    sweep = {"in_contact": (4, 6, 8, 12)}

    in_contact: int = 8  # particles from the middle of the contact to its edge
    strength: float = number(default=10.0)  # of the wall [-]

    def __attrs_post_init__(self) -> None:
        check_count("hertz", "in_contact", self.in_contact, 3)
        check_all_positive("hertz", self, strength="1 / spacings that the wall yields")

    @property
    def spacing(self) -> float:
        """[m]"""
        return _HALF_WIDTH / self.in_contact

    def scenes(self) -> Mapping[str, Scene]:
        side = _BLOCK * _HALF_WIDTH
        tags = {
            "middle": f"X < {0.1 * self.spacing!r}",
            "upper": f"Y > {side - 0.1 * self.spacing!r}",
        }
        shape = {"type": "polygon", "vertices": _outline(side, self.spacing)}
        builder = (
            solid(self.title, "foot", shape, self.spacing, MATERIAL, tags=tags)
            .boundary("clamp", where="middle", axes=["x"])
            .boundary(
                "prescribed-motion",
                where="upper",
                displacement={"y": f"-{_APPROACH * _HALF_WIDTH!r}*t"},
            )
            .effect(
                "rigid-wall",
                point={"y": 0.0},
                normal={"y": 1.0},
                clearance=0.0,
                strength=self.strength,
                label="plane",
            )
            .statics(load_steps=4)
            .duration(1.0)
        )
        return {"foot": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["foot"]
        width, peak = self.expected(record)
        found_width, found_peak = self.fitted(record)
        compare = partial(compared, record, source=_SOURCE, tolerance=_TOLERANCE)
        depth = -float(record.history["plane least gap [m]"][-1]) / self.spacing
        return [
            compare("half-width of the contact", found_width, "m", width),
            compare("peak pressure", found_peak, "Pa", peak),
            Measurement("load", self.load(record), "N/m", verdict="from which the two are found"),
            Measurement("largest penetration of the plane", depth, "spacings"),
        ]

    def load(self, record: Record) -> float:
        """P of the whole foot [N/m]"""
        return 2.0 * float(record.history["plane force y [N]"][-1])

    def expected(self, record: Record) -> tuple[float, float]:
        """Hertz's half-width [m] and peak pressure [Pa] under that load."""
        load = self.load(record)
        modulus = MATERIAL.youngs_modulus / (1.0 - MATERIAL.poissons_ratio**2)  # E*
        width = sqrt(4.0 * load * RADIUS / (pi * modulus))
        return width, 2.0 * load / (pi * width)

    def pressures(self, record: Record) -> tuple[Array, Array]:
        """Places (k,) [m] of the particles that touch, and pressures there (k,) [Pa]."""
        force = record.field("plane force")[-1][:, 1]
        touching = np.flatnonzero(force > 0.0)
        x = record.positions[-1][touching, 0]
        order = np.argsort(x)
        touching, x = touching[order], x[order]
        areas = np.where(record.particles.positions[touching, 0] < 0.1 * self.spacing, 0.5, 1.0)
        return x, np.asarray(force[touching] / (areas * self.spacing))

    def fitted(self, record: Record) -> tuple[float, float]:
        """Half-width [m] and peak pressure [Pa] of the half ellipse that fits best."""
        x, p = self.pressures(record)
        if len(x) < 3:
            return nan, nan
        slope, peak = np.polyfit(x**2, p**2, 1)
        return float(np.sqrt(-peak / slope)), float(np.sqrt(peak))

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The pressures beside Hertz's, and the stress above them."""
        record = records["foot"]
        x, p = self.pressures(record)
        width, peak = self.expected(record)
        along = np.linspace(0.0, width, 200)
        hertz = 1e-3 * peak * np.sqrt(1.0 - (along / width) ** 2)
        pressures = Panel(
            line(x, 1e-3 * p, "ko", markersize=4.0, label="simulated"),
            line(along, hertz, "-", color="tab:orange", label="Hertz"),
            x="x [m]",
            y="pressure [kPa]",
            ylim=(0.0, None),
            legend={},
        )
        places = record.positions[-1]
        near = np.all(places < 3.0 * width, axis=1)
        stress = record.field("cauchy_stress")[-1][near, 1, 1] / peak
        field = Panel(
            scatter(places[near], stress, "viridis", s=10),
            level(0.0, linewidth=1.0),
            x="x [m]",
            y="y [m]",
            aspect="equal",
        )
        title = f"{self.title}: {record.particles.count} particles"
        bars = [Bar("vertical stress [peak pressure]", [field])]
        return {"hertz": Sheet([[pressures, field]], (11.0, 4.4), title, bars=bars)}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        x, p = self.pressures(records["foot"])
        return {"hertz": {"x [m]": x, "pressure [Pa]": p}}


def _outline(side: float, spacing: float) -> list[list[float]]:
    """Corners of the half of the block, its round side straight from particle to particle."""
    x = np.linspace(0.0, side, round(side / spacing) + 1)
    round_side = [[float(a), float(a**2 / (2.0 * RADIUS))] for a in x]
    return [*round_side, [side, side], [0.0, side]]
